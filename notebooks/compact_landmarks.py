import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="Compact landmarks", css_file="notebook.css")

with app.setup:
    import marimo as mo

    from capture_plan import figures
    from capture_plan import notebooks_support as parts
    from capture_plan.audit.audit import audit_rig
    from capture_plan.evaluation.baseline_cache import measure, peers, predicted_by_seed, seeded
    from capture_plan.evaluation.zell2022.discarded_metrics import discarded_metrics
    from capture_plan.evaluation.zell2022.epsilon_sweep import epsilon_sweep
    from capture_plan.evaluation.zell2022.variants import by_metric, multicovers, single_cover, terms
    from capture_plan.layout.face import see_face


@app.cell(hide_code=True)
def title(rig):
    mo.md(f"""
    # Compact landmarks, figure by figure: {parts.markdown_plain(rig.name)}

    Zell and McDonnell (2022) ask for the fewest landmarks that show every blendshape at least once. Here is every
    kind of figure of their paper, drawn from this rig: what you see on your own face is what their method does there.
    """)
    return


@app.cell
def rig_of_the_session():
    rig = parts.chosen_rig()
    sitter = figures.sit(rig)
    return rig, sitter


@app.cell
def seen(rig):
    with parts.working():
        face = see_face(rig, audit_rig(rig).used)
    return (face,)


@app.cell
def paper_knobs():
    knobs = parts.cover_knobs()
    knobs
    return (knobs,)


@app.cell(hide_code=True)
def about_epsilon():
    mo.md("""
    ## A higher epsilon asks for more landmarks

    A vertex can stand for a blendshape that moves it by epsilon of the blendshape's largest movement. Nobody sets
    the number of landmarks M: it follows, for a rig of K blendshapes.
    """)
    return


@app.cell
def swept(face, knobs):
    with parts.working():
        rows = epsilon_sweep(face, parts.cover_settings(knobs))
    return (rows,)


@app.cell
def teaser(face, rows, sitter):
    parts.figure_view(figures.teaser(sitter, face, rows), "Layouts of the paper's sum over epsilon.", name="teaser")
    return


@app.cell
def number_against_epsilon(rows):
    parts.figure_view(
        figures.number_against_epsilon(rows),
        "The paper's weights cost landmarks: a landmark pays once for each blendshape that it stands for.",
        name="number-against-epsilon",
    )
    return


@app.cell(hide_code=True)
def about_models():
    mo.md("""
    ## Every rig asks for its own number

    Open this notebook with `-- --rig PATH --beside PATH`, the second as often as you like, to see rigs side by side.
    """)
    return


@app.cell
def models(face, knobs, rig, sitter):
    with parts.working():
        shown = [(sitter, face)] + [
            (figures.sit(other), see_face(other, audit_rig(other).used)) for other in parts.neighbouring_rigs(rig)[1:]
        ]
        covered = [(one, of_rig, single_cover(of_rig, parts.cover_settings(knobs))) for one, of_rig in shown]
    parts.figure_view(figures.models(covered), "One layout for each rig, at the epsilon above.", name="models")
    return


@app.cell(hide_code=True)
def about_occlusion():
    mo.md("""
    ## What expressions hide

    Ambient occlusion of every expression, the worst of all counting. The second head shows how much the neutral
    face alone would have promised in vain.
    """)
    return


@app.cell
def occlusion(face, sitter):
    parts.figure_view(
        figures.occlusion(sitter, face),
        "Clay: skin that no blendshape moves.",
        name="occlusion",
    )
    return


@app.cell(hide_code=True)
def about_terms():
    mo.md("""
    ## What makes one place better than another

    The same cover weighed by displacement alone, by visibility alone, by both, and for mirrored pairs.
    """)
    return


@app.cell
def single_covers(face, knobs, sitter):
    with parts.working():
        under_terms = terms(face, parts.cover_settings(knobs))
    parts.figure_view(figures.named_layouts(sitter, under_terms), "Layouts under each term.", name="terms")
    return


@app.cell(hide_code=True)
def about_multicovers():
    mo.md("""
    ## Two landmarks for every blendshape

    Asked for two, the plain program puts them side by side. A particle swarm spreads them, a bit at random. The
    spacing belongs into the program; and the adaptive cover spends landmarks where blendshapes overlap.
    """)
    return


@app.cell
def doubled(face, knobs, sitter):
    with parts.working():
        multiple = multicovers(face, parts.cover_settings(knobs))
    parts.figure_view(figures.named_layouts(sitter, multiple), "Forms of the multi-cover.", name="multicovers")
    return


@app.cell(hide_code=True)
def about_replacements():
    mo.md("""
    ## A few millimetres aside is nearly as good

    Every vertex that could take the ringed landmark's place, the cover staying a cover. Where the colours around
    it are alike, the make-up artist may be a little off.
    """)
    return


@app.cell
def replacements(face, knobs, sitter):
    parts.figure_view(
        figures.replacements(
            sitter, face, parts.cover_settings(knobs), single_cover(face, parts.cover_settings(knobs))
        ),
        "Importance weight of every vertex in the place of a landmark.",
        name="replacements",
    )
    return


@app.cell
def blendshape_of_the_map(face):
    blendshape = parts.blendshape_knob(face.used)
    blendshape
    return (blendshape,)


@app.cell
def suited(blendshape, face, knobs, sitter):
    parts.figure_view(
        figures.suited(sitter, face, parts.cover_settings(knobs), [blendshape.value]),
        "Importance weight of every candidate for this blendshape.",
        name="suited",
    )
    return


@app.cell
def stands_for(face, knobs):
    parts.figure_view(
        parts.incidence_figure(face, parts.cover_settings(knobs), single_cover(face, parts.cover_settings(knobs))),
        "Which landmark of the cover stands for which blendshape.",
        name="incidence",
    )
    return


@app.cell(hide_code=True)
def about_discarded():
    mo.md("""
    ## What was tried and discarded

    Curvature, saliency and conditioning know nothing of how far the skin moves: they like folds, nostrils and lids.
    SIFT, which the paper tried too, needs a photograph on the skin, and a rig comes without one.
    """)
    return


@app.cell
def metrics(face):
    with parts.working():
        discarded = discarded_metrics(face)
    return (discarded,)


@app.cell
def metric_maps(discarded, sitter):
    parts.figure_view(figures.discarded(sitter, discarded), "The discarded metrics on the head.", name="discarded")
    return


@app.cell
def metric_layouts(discarded, face, knobs, sitter):
    parts.figure_view(
        figures.named_layouts(sitter, by_metric(face, parts.cover_settings(knobs), discarded)),
        "The cover when each takes the place of displacement.",
        name="discarded-layouts",
    )
    return


@app.cell(hide_code=True)
def about_methods():
    mo.md("""
    ## Other methods with as many landmarks

    All of them choose from the same skin. The millimetres are what is left of the skin's error when weights are
    solved from noisy landmarks (0.2 mm) over random mixes of blendshapes.
    """)
    return


@app.cell
def methods(face, knobs, sitter):
    with parts.working():
        cover = single_cover(face, parts.cover_settings(knobs))
        layouts = {"Set cover": cover} | peers(face, parts.cover_settings(knobs), len(cover))
        scores = measure(face, layouts, parts.cover_settings(knobs).noise_mm)
    parts.figure_view(
        figures.named_layouts(sitter, layouts, {name: f"{score.rmse_mm:.2f} mm" for name, score in scores.items()}),
        "Methods at the number of landmarks that the cover settled on.",
        name="methods",
    )
    return (cover,)


@app.cell(hide_code=True)
def about_seeds():
    mo.md("""
    ## The luck of the start

    Methods that start at random end elsewhere for every seed. The cover has no seed: it is the optimum.
    """)
    return


@app.cell
def seeds(cover, face, knobs, sitter):
    with parts.working():
        by_seed = seeded(face, parts.cover_settings(knobs), len(cover))
        errors = predicted_by_seed(face.observation(parts.cover_settings(knobs).noise_mm), by_seed)
    parts.figure_view(
        figures.seeds(sitter, by_seed, errors),
        "A row a method, a head a seed: upper estimate.",
        name="seeds",
    )
    return


if __name__ == "__main__":
    app.run()
