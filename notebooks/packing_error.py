import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="What packing is worth", css_file="notebook.css")

with app.setup:
    import marimo as mo
    from msgspec.structs import replace

    from capture_plan import figures
    from capture_plan import notebooks_support as parts
    from capture_plan.audit.audit import audit_rig
    from capture_plan.evaluation.carrigan2020.mu_sweep import importance_ablation, mu_sweep
    from capture_plan.evaluation.carrigan2020.packing_error import errors_of_lists, rival_lists, typical_target
    from capture_plan.expressions.active_sets import vertex_roles
    from capture_plan.expressions.pack import pack
    from capture_plan.plan.collide import collide


@app.cell(hide_code=True)
def title(rig):
    mo.md(f"""
    # What packing is worth: {parts.markdown_plain(rig.name)}

    Packing performs blendshapes in one expression that move different parts of the face. It saves scans; here is what
    it costs and what it brings: how short a list can be, what comes first, and how well another face's rig is rebuilt
    from the first scans.
    """)
    return


@app.cell
def rig_of_the_session():
    rig = parts.chosen_rig()
    sitter = figures.sit(rig)
    with parts.working():
        used = audit_rig(rig).used
    return rig, sitter, used


@app.cell
def packing_knobs():
    knobs = parts.packing_error_knobs()
    knobs
    return (knobs,)


@app.cell
def decided(knobs, rig, used):
    settings = parts.packing_settings(knobs)
    with parts.working():
        apart = collide(rig, used, settings)
    return apart, settings


@app.cell(hide_code=True)
def about_mu():
    mo.md("""
    ## A higher mu packs more into an expression

    The higher mu, the fewer vertices count as moved, and the fewer blendshapes clash. The minimum is proved: where
    another method meets it, that method found a shortest list too. Rules keep apart what no face can do at once, and
    that costs expressions.
    """)
    return


@app.cell
def swept(apart, rig, settings, used):
    with parts.working():
        mus = (0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5, 0.55, 0.6)
        ruled, free = replace(settings, poseable=True), replace(settings, poseable=False)
        by_rules = {
            "With rules": mu_sweep(rig, used, ruled, mus, apart=apart or collide(rig, used, ruled)),
            "Without rules": mu_sweep(rig, used, free, mus),
        }
    return (by_rules,)


@app.cell
def number_against_mu(by_rules, settings):
    parts.figure_view(
        figures.number_against_mu(by_rules, mu=settings.mu),
        "Expressions that show every blendshape once, over mu; the upright line is the mu of the knob.",
        name="number-against-mu",
    )
    return


@app.cell(hide_code=True)
def about_terms():
    mo.md("""
    ## What comes first

    The importance of a blendshape can be its displacement, how differently the actor's face is built where it moves
    (distortion, here towards another person's face), how unlike it is to what is already scanned (uniqueness), or the
    error that its scan is expected to take from the rebuilt rig. All orders are judged by the displacement that they
    have shown, which favours displacement itself: what the orders are really worth stands further below.
    """)
    return


@app.cell
def ablation(apart, rig, settings, used):
    with parts.working():
        by_terms = importance_ablation(rig, used, settings, target=typical_target(rig), apart=apart)
    return (by_terms,)


@app.cell
def shown_by_terms(by_terms, used):
    parts.figure_view(
        figures.shown_by_terms(by_terms, blendshapes=len(used)),
        "What has been shown after every expression, for each form of importance.",
        name="shown-by-terms",
    )
    return


@app.cell
def table_of_terms(by_terms):
    parts.ablation_table(by_terms)
    return


@app.cell(hide_code=True)
def about_roles():
    mo.md("""
    ## Where a blendshape claims the skin

    Active skin is claimed: no other blendshape of the expression may be active there. Smoothing skin moves along and
    may be shared. Static skin does not move.
    """)
    return


@app.cell
def blendshape_of_the_head(used):
    blendshape = parts.blendshape_knob(used)
    blendshape
    return (blendshape,)


@app.cell
def roles(blendshape, rig, settings, sitter, used):
    parts.figure_view(
        figures.roles_figure(sitter, vertex_roles(rig, used, settings, blendshape.value), blendshape.value),
        "Static, smoothing and active vertices of the skin, at the mu of the knob.",
        name="roles",
    )
    return


@app.cell(hide_code=True)
def about_error():
    mo.md("""
    ## What the rebuilt rig is worth

    Other faces whose true rig is known are scanned as the list says, and their rig is rebuilt from the first scans by
    example-based transfer. Three of them are this face made lower, wider or narrower; the others are persons with
    habits of their own. Only one person is tried until you ask for more: a face takes a few seconds on a small rig,
    half a minute on one of 25,000 vertices, and is remembered.

    All packed lists obey the same rules. Their importance is the squared error that a scan is expected to take away;
    the paper's importance is the minimum too, weighed by displacement.
    """)
    return


@app.cell
def persons():
    people = parts.people_knob()
    people
    return (people,)


@app.cell
def information(apart, people, rig, settings, used):
    with parts.working():
        errors = errors_of_lists(rig, rival_lists(rig, used, settings, apart=apart), people=people.value)
    return (errors,)


@app.cell
def who_is_best(errors):
    parts.saving_words(errors)
    return


@app.cell
def error_by_scans(errors):
    parts.figure_view(
        figures.error_by_scans(errors, ours="early", cut="one at a time"),
        "Error of the rig over all blendshapes and the skin; random is the mean of three lists.",
        name="error-by-scans",
    )
    return


@app.cell
def table_of_errors(errors):
    parts.value_table(errors)
    return


@app.cell(hide_code=True)
def about_list():
    mo.md("""
    ## The list

    The shortest list with the knobs above, the most important expression first.
    """)
    return


@app.cell
def packed(apart, rig, settings, used):
    with parts.working():
        packing = pack(rig, used, settings, apart=apart)
    return (packing,)


@app.cell
def first_expressions(packing, sitter):
    parts.figure_view(
        figures.expressions_figure(sitter, packing.expressions[:8]),
        "The first expressions, every blendshape at full weight.",
        name="expressions",
    )
    return


@app.cell
def list_of_expressions(packing):
    parts.packing_view(packing)
    return


@app.cell
def head(packing, rig):
    parts.packing_head(rig, packing)
    return


if __name__ == "__main__":
    app.run()
