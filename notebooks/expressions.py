import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="Expressions", css_file="notebook.css")

with app.setup:
    import marimo as mo

    from capture_plan import notebooks_support as parts
    from capture_plan.audit.audit import audit_rig
    from capture_plan.expressions.pack import pack
    from capture_plan.plan.collide import collide


@app.cell(hide_code=True)
def title(rig):
    mo.md(f"""
    # Which expressions to scan: {parts.markdown_plain(rig.name)}

    Blendshapes that move different parts of the face are performed in one expression, so that fewer scans show
    them all. The most important expressions come first: when time runs out, stop, and the list has still shown
    the most it could.
    """)
    return


@app.cell
def rig_of_the_session():
    rig = parts.chosen_rig()
    with parts.working():
        report = audit_rig(rig)
    return report, rig


@app.cell
def expression_knobs():
    knobs = parts.expression_knobs()
    knobs
    return (knobs,)


@app.cell
def packed(knobs, report, rig):
    with parts.working():
        settings = parts.packing_settings(knobs)
        packing = pack(rig, report.used, settings, apart=collide(rig, report.used, settings))
    return (packing,)


@app.cell
def figures(packing):
    parts.packing_view(packing)
    return


@app.cell
def head(packing, rig):
    parts.packing_head(rig, packing)
    return


if __name__ == "__main__":
    app.run()
