import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="Sheets", css_file="notebook.css")

with app.setup:
    import marimo as mo

    from capture_plan import notebooks_support as parts
    from capture_plan.plan.make import make_plan


@app.cell(hide_code=True)
def title(rig):
    mo.md(f"""
    # What is printed: {parts.markdown_plain(rig.name)}

    The make-up artist gets the marker sheets, each of them again as the make-up mirror shows it; the actor gets a
    page for every expression. Print at 100 % and lay a ruler on the check bar: it measures 50 mm.
    """)
    return


@app.cell
def rig_of_the_session():
    rig = parts.chosen_rig()
    return (rig,)


@app.cell
def planned(rig):
    with parts.working():
        plan = make_plan(rig, reference=parts.rig_reference(rig))
    return (plan,)


@app.cell
def paper_of_the_session():
    paper = parts.paper_knob()
    paper
    return (paper,)


@app.cell
def drawn(paper, plan, rig):
    with parts.working():
        pages = parts.sheet_pages(plan, rig, paper.value)
    return (pages,)


@app.cell
def gallery(pages):
    parts.page_gallery(pages)
    return


@app.cell
def printed(paper, plan, rig):
    parts.sheet_download(plan, rig, paper.value)
    return


if __name__ == "__main__":
    app.run()
