import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="1 From a rig to a printed page", css_file="../notebook.css")

with app.setup:
    import tempfile
    from pathlib import Path

    import marimo as mo

    from capture_plan import audit_rig, check_plan, make_plan, sample_rig, write_sheets
    from capture_plan import notebooks_support as parts
    from capture_plan.audit.report import audit_text
    from capture_plan.plan.summary import summary


@app.cell(hide_code=True)
def title():
    mo.md("""
    # 1 From a rig to a printed page

    Five calls lead from a blendshape rig to pages that a make-up artist and an actor can work from. Here they run on
    the bundled head; `read_rig("hero.fbx")` in the first cell reads yours.
    """)
    return


@app.cell
def a_rig():
    rig = sample_rig()
    return (rig,)


@app.cell(hide_code=True)
def about_the_audit():
    mo.md("""
    ## Is it read right?

    Everything that follows stands on how the rig was understood: which way is up, how long a millimetre is, where the
    eyes and the mouth are. Read the first line. Where it says *Look at how it was understood first*, do that.
    """)
    return


@app.cell
def audited(rig):
    report = audit_rig(rig)
    parts.printed(audit_text(report))
    return


@app.cell(hide_code=True)
def about_the_plan():
    mo.md("""
    ## The plan

    One call decides where markers go and which expressions are scanned in which order. What it says is what can be
    proved, and what error is to be expected.
    """)
    return


@app.cell
def planned(rig):
    plan = make_plan(rig)
    return (plan,)


@app.cell
def said(plan):
    parts.printed("\n".join(summary(plan)))
    return


@app.cell
def head(plan, rig):
    parts.plan_view(rig, plan)
    return


@app.cell(hide_code=True)
def about_the_check():
    mo.md("""
    ## Does it hold?

    `check_plan` computes again what the plan claims, from the rig alone and without the solver that made it.
    """)
    return


@app.cell
def checked(plan, rig):
    claims = check_plan(plan, rig)
    parts.printed(f"{sum(claim.holds for claim in claims)} of {len(claims)} claims hold")
    return (claims,)


@app.cell(hide_code=True)
def about_the_pages():
    mo.md("""
    ## The pages

    Print them at 100 % and hold a ruler to the bar of 50 mm: the face on paper is as large as the actor's. Here they
    are drawn coarsely, for the screen.
    """)
    return


@app.cell
def drawn(plan, rig):
    with tempfile.TemporaryDirectory() as folder:
        _, *pages = write_sheets(plan, rig, Path(folder), paper="a4", dpi=72)
        pictures = {page.stem.split("-", 1)[1].replace("-", " "): page.read_bytes() for page in pages}
    return (pictures,)


@app.cell
def gallery(pictures):
    parts.page_gallery(pictures)
    return


@app.cell(hide_code=True)
def on_the_command_line():
    mo.md("""
    ## The same on the command line

    ```
    capture-plan audit sample
    capture-plan plan sample -o hero.plan.json
    capture-plan check hero.plan.json
    capture-plan render hero.plan.json -o sheets
    capture-plan export hero.plan.json -o export
    ```
    Next: *2 Which method when*.
    """)
    return


if __name__ == "__main__":
    app.run()
