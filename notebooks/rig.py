import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="Rig", css_file="notebook.css")

with app.setup:
    import marimo as mo

    from capture_plan import notebooks_support as parts
    from capture_plan.audit.audit import audit_rig


@app.cell(hide_code=True)
def title(rig):
    mo.md(f"""
    # The rig: {parts.markdown_plain(rig.name)}

    Everything that is planned later stands on this rig. Read what was found before you book the actor: a
    blendshape that is left out here gets no landmark and no expression.
    """)
    return


@app.cell
def rig_of_the_session():
    rig = parts.chosen_rig()
    return (rig,)


@app.cell
def audited(rig):
    with parts.working():
        report = audit_rig(rig)
    return (report,)


@app.cell
def audit_shown(report):
    parts.audit_view(report)
    return


@app.cell(hide_code=True)
def about_the_head():
    mo.md("""
    ## One blendshape at a time

    Turn the head by dragging it. Step through the blendshapes beside it; *Colour by movement* shows where the
    skin moves, and how far in millimetres.
    """)
    return


@app.cell
def head(report, rig):
    parts.blendshape_head(rig, report)
    return


if __name__ == "__main__":
    app.run()
