import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="Layouts compared", css_file="notebook.css")

with app.setup:
    import marimo as mo

    from capture_plan import notebooks_support as parts
    from capture_plan.audit.audit import audit_rig
    from capture_plan.evaluation.baseline_cache import measure, peers, peers_by_budget, placed_points
    from capture_plan.evaluation.compare import error_driven
    from capture_plan.layout.face import see_face
    from capture_plan.layout.settings import LayoutSettings


@app.cell(hide_code=True)
def title(rig):
    mo.md(f"""
    # What a marker buys: {parts.markdown_plain(rig.name)}

    With as many markers, some layouts tell more of the face than others. Turn a knob and see where the markers go,
    what is left of the error beside other methods, and which blendshapes stay doubtful.
    """)
    return


@app.cell
def rig_of_the_session():
    rig = parts.chosen_rig()
    with parts.working():
        face = see_face(rig, audit_rig(rig).used)
    return face, rig


@app.cell
def knobs():
    epsilon, budget, noise, spacing = parts.comparing_knobs()
    parts.knob_panel(epsilon, budget, noise, spacing)
    return budget, epsilon, noise, spacing


@app.cell
def designed(budget, epsilon, face, noise, spacing):
    with parts.working():
        layout = error_driven(face, parts.comparing_settings(epsilon, noise, spacing), budget.value)
    return (layout,)


@app.cell
def others_of_the_budget(budget, face):
    with parts.working():
        others = peers(face, LayoutSettings(), budget.value) | placed_points(face)
    return (others,)


@app.cell
def figures_of_the_layout(face, layout, noise, others):
    parts.comparison_tiles(face, layout, others, noise.value)
    return


@app.cell
def light(rig):
    shade = parts.openness(rig)
    return (shade,)


@app.cell
def head(epsilon, face, layout, noise, shade, spacing):
    parts.landmarks_head(face, parts.comparing_settings(epsilon, noise, spacing), layout, shade)
    return


@app.cell(hide_code=True)
def about_the_table():
    mo.md("""
    ## The same number of markers, other methods

    Random mixes of three to eight blendshapes, measured with the same noise, solved for weights between 0 and 1,
    laid over the truth.
    """)
    return


@app.cell
def measured(face, layout, noise, others):
    with parts.working():
        scores = measure(face, {parts.OURS: layout} | others, noise.value)
    return (scores,)


@app.cell
def table(layout, others, scores):
    parts.comparison_table({parts.OURS: layout} | others, scores)
    return


@app.cell(hide_code=True)
def about_the_worst():
    mo.md("""
    ## Which blendshapes stay doubtful

    What the uncertainty of each weight alone costs on the skin, for the blendshapes that our layout knows worst.
    """)
    return


@app.cell
def worst(face, layout, noise, others):
    parts.figure_view(
        parts.worst_blendshapes(face, layout, others, noise.value),
        "Upper estimate of the error from each blendshape, root mean square; beside ours the best other layout.",
        name="worst-blendshapes",
    )
    return


@app.cell
def over_noise(face, layout, others):
    parts.figure_view(
        parts.noise_curves(face, layout, others),
        "Upper estimate of the same layouts when landmarks are measured better or worse.",
        name="error-against-noise",
    )
    return


@app.cell(hide_code=True)
def about_the_curve():
    mo.md("""
    ## Error against budget

    The upper estimate of the error, for weights of any size, for every number of markers; ours is drawn in the order
    in which its markers tell most, up to the budget. The dashed line is the usual set of 68 points.
    """)
    return


@app.cell
def others_of_all_budgets(face):
    with parts.working():
        by_budget = peers_by_budget(face, LayoutSettings())
    return (by_budget,)


@app.cell
def curve(by_budget, face, layout, noise, others):
    parts.figure_view(
        parts.budget_curves(face, layout, by_budget, others, noise.value),
        "Upper estimate of the error of the skin, root mean square, by the number of markers.",
        name="error-against-budget",
    )
    return


if __name__ == "__main__":
    app.run()
