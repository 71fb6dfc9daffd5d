import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="Capture session", css_file="notebook.css")

with app.setup:
    import marimo as mo

    from capture_plan import notebooks_support as parts
    from capture_plan.audit.audit import audit_rig
    from capture_plan.camera import cameras_for
    from capture_plan.expressions.pack import pack
    from capture_plan.layout.design import design_layout
    from capture_plan.layout.face import see_face
    from capture_plan.plan.collide import collide
    from capture_plan.plan.make import assemble_plan


@app.cell(hide_code=True)
def title(rig):
    mo.md(f"""
    # A capture session: {parts.markdown_plain(rig.name)}

    Where to put which marker on the actor's face, which expressions to scan in which order, and why. Walk down
    the page, turn what you want to turn, and take the plan with you at the end.
    """)
    return


@app.cell(hide_code=True)
def stop():
    parts.stop_link()
    return


@app.cell
def rig_of_the_session():
    rig = parts.chosen_rig()
    return (rig,)


@app.cell(hide_code=True)
def about_the_rig():
    mo.md("""
    ## The rig

    A blendshape that is left out here gets no landmark and no expression, and the reason stands beside it.
    """)
    return


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
def about_visibility():
    mo.md("""
    ## What can be seen

    A landmark is worth nothing where a lip, a lid or the nose hides it. The worst of all expressions counts; on
    the head, the darker, the less it is seen. Turn it by dragging.
    """)
    return


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
def visibility_figures(face):
    parts.visibility_view(face)
    return


@app.cell
def visibility_head(face):
    parts.visibility_head(face)
    return


@app.cell(hide_code=True)
def about_landmarks():
    mo.md("""
    ## Landmarks

    Every blendshape needs a landmark that it moves, and the landmarks together have to tell blendshapes apart.
    Fewer are quicker to apply; more forgive more noise. No two dots meet when the face moves: other expressions below
    may move a landmark here.
    """)
    return


@app.cell
def recorded(rig):
    takes = parts.takes_of_the_session(rig)
    return (takes,)


@app.cell
def landmark_knobs(takes):
    landmarks = parts.landmark_knobs(take=takes is not None)
    landmarks
    return (landmarks,)


@app.cell
def designed(face, landmarks, packing, takes):
    with parts.working():
        layout_settings = parts.landmark_settings(landmarks, face, takes, packing.poses)
        layout = design_layout(face, layout_settings, takes=takes, poses=packing.poses)
    return layout, layout_settings


@app.cell
def layout_figures(layout):
    parts.layout_view(layout)
    return


@app.cell
def landmark_table(layout):
    parts.landmark_table(layout)
    return


@app.cell(hide_code=True)
def about_expressions():
    mo.md("""
    ## Expressions

    Blendshapes that move different parts of the face are performed in one expression. The most important come
    first: when time runs out, stop, and the list has still shown the most it could.
    """)
    return


@app.cell
def expression_knobs():
    expressions = parts.expression_knobs()
    expressions
    return (expressions,)


@app.cell
def packed(expressions, report, rig):
    with parts.working():
        chosen = parts.packing_settings(expressions)
        packing = pack(rig, report.used, chosen, apart=collide(rig, report.used, chosen))
    return (packing,)


@app.cell
def packing_figures(packing):
    parts.packing_view(packing)
    return


@app.cell(hide_code=True)
def about_the_head():
    mo.md("""
    ## The plan on the head

    Turn the head, point at a marker to see what it is for, and step through the expressions in the order of
    shooting.
    """)
    return


@app.cell
def planned(cameras, expressions, face, layout, packing, report, rig, layout_settings):
    settings = parts.session_settings(layout_settings, expressions, cameras, sequences=parts.given_takes())
    plan = assemble_plan(
        rig, settings, report, layout, packing, cameras=face.cameras, reference=parts.rig_reference(rig)
    )
    return (plan,)


@app.cell
def plan_head(plan, rig):
    parts.plan_view(rig, plan)
    return


@app.cell
def what_cameras_see(plan, rig):
    parts.cameras_view(rig, plan)
    return


@app.cell(hide_code=True)
def about_the_sheets():
    mo.md("""
    ## Sheets for print

    Marker sheets for the make-up artist, one of them mirrored for the make-up mirror, and a page for every
    expression. Print at 100 % and lay a ruler on the check bar: it measures 50 mm.
    """)
    return


@app.cell
def paper_of_the_session():
    paper = parts.paper_knob()
    draw = mo.ui.run_button(label="Draw the sheets of this plan")
    mo.hstack([paper, draw], justify="start", gap=2)
    return draw, paper


@app.cell
def sheets_shown(draw, paper, plan, rig):
    mo.stop(not parts.wanted(draw), mo.md("*The sheets are drawn when you ask for them: that takes some seconds.*"))
    with parts.working():
        pages = parts.sheet_pages(plan, rig, paper.value)
    parts.page_gallery(pages)
    return


@app.cell(hide_code=True)
def about_the_files():
    mo.md("""
    ## Take it with you

    The HTML plan opens on any computer and telephone without a network. `plan.json` holds every number; the
    command line checks, draws and exports it. The HTML plan and the sheets are made when you ask for them.
    """)
    return


@app.cell
def files(paper, plan, rig):
    parts.downloads(plan, rig, paper.value)
    return


if __name__ == "__main__":
    app.run()
