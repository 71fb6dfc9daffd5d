import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="Visibility", css_file="notebook.css")

with app.setup:
    import marimo as mo

    from capture_plan import notebooks_support as parts
    from capture_plan.audit.audit import audit_rig
    from capture_plan.camera import cameras_for
    from capture_plan.layout.face import see_face


@app.cell(hide_code=True)
def title(rig):
    mo.md(f"""
    # What can be seen: {parts.markdown_plain(rig.name)}

    A landmark is worth nothing where a lip, a lid or the nose hides it. For every point of the skin, rays say
    from which share of the directions it is seen, and the worst of all expressions counts.
    """)
    return


@app.cell
def rig_of_the_session():
    rig = parts.chosen_rig()
    with parts.working():
        report = audit_rig(rig)
    return report, rig


@app.cell
def cameras_of_the_session():
    cameras = parts.camera_knob()
    cameras
    return (cameras,)


@app.cell
def seen(cameras, report, rig):
    with parts.working():
        face = see_face(rig, report.used, cameras_for(cameras.value, rig.neutral, rig.skin) if cameras.value else ())
    return (face,)


@app.cell
def figures(face):
    parts.visibility_view(face)
    return


@app.cell(hide_code=True)
def about_the_head():
    mo.md("""
    ## The darker, the less it is seen

    Turn the head by dragging it. What no blendshape moves is drawn in full light: no landmark goes there.
    """)
    return


@app.cell
def head(face):
    parts.visibility_head(face)
    return


if __name__ == "__main__":
    app.run()
