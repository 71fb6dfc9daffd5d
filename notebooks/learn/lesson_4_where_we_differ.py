import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="4 Where we differ from the papers", css_file="../notebook.css")

with app.setup:
    import marimo as mo

    from capture_plan import LayoutSettings, PackingSettings, audit_rig, sample_rig
    from capture_plan import notebooks_support as parts
    from capture_plan.expressions.pack import pack
    from capture_plan.layout.design import design_layout
    from capture_plan.layout.face import see_face


@app.cell(hide_code=True)
def title():
    mo.md(r"""
    # 4 Where we differ from the papers, and why

    This package stands on three papers. Each of them is here as it was written, by name, so that you can compare; and
    each of the defaults goes further where a face, a camera or a solver asks for it.

    ## Zell & McDonnell 2022: compact landmarks

    Their program looks for landmarks such that every blendshape has one that it moves by at least epsilon of its
    largest displacement. With the weight of eq. 1, *w = 2 - (1 - alpha) r - alpha l*, every landmark costs once *for
    each blendshape that it stands for*, so that sharing a landmark gains nothing. Counted first and placed second
    there are fewer:
    """)
    return


@app.cell
def head():
    rig = sample_rig()
    face = see_face(rig)
    return face, rig


@app.cell
def covers(face):
    weights = {"paper": "the paper's sum", "lexicographic": "fewest first, then the best places"}
    found = {name: design_layout(face, LayoutSettings(method="cover", weights=name)) for name in weights}
    parts.table(
        ("Weights", "Landmarks", "Mixes distinguished", "Upper estimate"),
        [
            (
                f"{name}: {weights[name]}",
                f"{len(one.landmarks)}",
                f"{one.information.rank} of {one.information.full_rank}",
                f"{one.information.error_mm:.2f} mm",
            )
            for name, one in found.items()
        ],
    )
    return


@app.cell(hide_code=True)
def about_rank():
    mo.md(r"""
    One landmark for every blendshape is not enough to tell blendshapes apart: *M* landmarks give 3 *M* numbers, and
    with fewer numbers than blendshapes some movements look alike. The default therefore also asks for the error of 68
    points, and that all mixes be distinguished which cost the others little. It needs more landmarks than a cover, and
    half as many as 68:
    """)
    return


@app.cell
def our_default(face):
    ours = design_layout(face, LayoutSettings())
    parts.table(
        ("Default", "Landmarks", "Mixes distinguished", "Upper estimate"),
        [
            (
                "studio",
                f"{len(ours.landmarks)}",
                f"{ours.information.rank} of {ours.information.full_rank}",
                f"{ours.information.error_mm:.2f} mm",
            )
        ],
    )
    return


@app.cell(hide_code=True)
def about_shells():
    mo.md(r"""
    ## Le, Zhu & Deng 2013: markers of a take

    Markers bend a thin shell so that it follows a recorded take. Three things are otherwise than printed:

    - Eq. 12 is transposed in print: the path of a marker is *H = R W / (Wᵀ W)*, with *W* its weights and *R* what the
      others leave.
    - Bending has one more 1/length² than stretching, so that their ratio 1 : 10 means something only in millimetres.
    - Instead of ten random starts that walk up and down, ours is a greedy layout followed by exact exchanges. The
      error never goes up, and the same take gives the same layout.

    *5 The three papers in ten lines each* runs both on one take.

    ## Carrigan et al. 2020: expression packing

    Blendshapes that move different skin share an expression. Algorithm 1 takes the expression of most importance
    first, then the next. The fewest expressions are another question, a colouring of the conflict graph, with a proof
    by a clique:
    """)
    return


@app.cell
def lists(rig):
    used = audit_rig(rig).used
    packed = {name: pack(rig, used, PackingSettings(method=name)) for name in ("sequential", "minimum", "early")}
    parts.table(
        ("List", "Expressions", "At least, proved", "Importance shown after five"),
        [
            (name, f"{one.objective}", f"{one.bound}", f"{one.expressions[4].covered:.0%}")
            for name, one in packed.items()
        ],
    )
    return


@app.cell(hide_code=True)
def about_faces():
    mo.md("""
    What no face does at once is kept apart: closed and wide eyes, lips closed over an open jaw, lids and lips that
    would run through each other. These rules are names and costs in a file that you can copy and change.
    """)
    return


if __name__ == "__main__":
    app.run()
