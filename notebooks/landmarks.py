import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="Landmarks", css_file="notebook.css")

with app.setup:
    import marimo as mo

    from capture_plan import notebooks_support as parts
    from capture_plan.audit.audit import audit_rig
    from capture_plan.layout.design import design_layout
    from capture_plan.layout.face import see_face


@app.cell(hide_code=True)
def title(rig):
    mo.md(f"""
    # Where to put how few markers: {parts.markdown_plain(rig.name)}

    Every blendshape needs a landmark that it moves, and the landmarks together have to tell blendshapes apart.
    Fewer landmarks are quicker to apply; more of them forgive more noise. Turn a knob and read what it costs.
    """)
    return


@app.cell
def rig_of_the_session():
    rig = parts.chosen_rig()
    with parts.working():
        report = audit_rig(rig)
    return report, rig


@app.cell
def seen(report, rig):
    with parts.working():
        face = see_face(rig, report.used)
    return (face,)


@app.cell
def landmark_knobs():
    knobs = parts.landmark_knobs()
    knobs
    return (knobs,)


@app.cell
def agreed_before():
    before, agree = mo.state(None)
    return agree, before


@app.cell
def designed(agree, before, face, knobs):
    with parts.working():
        layout = design_layout(face, parts.landmark_settings(knobs, face), former=before())
    agree(layout)
    return (layout,)


@app.cell
def figures(layout):
    parts.layout_view(layout)
    return


@app.cell
def head(face, layout):
    parts.layout_head(face, layout)
    return


@app.cell
def table(layout):
    parts.landmark_table(layout)
    return


if __name__ == "__main__":
    app.run()
