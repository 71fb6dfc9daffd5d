import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="5 The three papers in ten lines each", css_file="../notebook.css")

with app.setup:
    import marimo as mo

    from capture_plan import LayoutSettings, PackingSettings, audit_rig, sample_rig
    from capture_plan import notebooks_support as parts
    from capture_plan.evaluation.carrigan2020 import mu_sweep
    from capture_plan.evaluation.le2013 import by_method
    from capture_plan.evaluation.zell2022 import epsilon_sweep
    from capture_plan.layout.face import see_face
    from capture_plan.sample.motion import sample_motion
    from capture_plan.shell.take import face_take


@app.cell(hide_code=True)
def title():
    mo.md("""
    # 5 The three papers in ten lines each

    The central figure of each paper, on a rig of yours: change the next cell. The rest stays as it is.
    """)
    return


@app.cell
def your_rig():
    rig = sample_rig()
    face = see_face(rig)
    return face, rig


@app.cell(hide_code=True)
def zell():
    mo.md("""
    ## Zell & McDonnell 2022, fig. 3: landmarks against epsilon

    The higher the share of its movement that a landmark must show of a blendshape, the more landmarks it takes.
    """)
    return


@app.cell
def landmarks_against_epsilon(face):
    rows = epsilon_sweep(face, LayoutSettings(), (0.3, 0.5, 0.7))
    parts.table(
        ("Epsilon", "Fewest landmarks", "At least, proved", "The paper's sum"),
        [(f"{row.epsilon}", f"{row.fewest}", f"{row.bound}", f"{len(row.paper_vertices)}") for row in rows],
    )
    return (rows,)


@app.cell(hide_code=True)
def le():
    mo.md("""
    ## Le, Zhu & Deng 2013, fig. 12: the error of each method

    One made-up take, one shell, one number of markers; only the places differ.
    """)
    return


@app.cell
def error_of_each_method(face, rig):
    take = face_take(rig, sample_motion(0, frames=30))
    scored = by_method(take, face, (12,))
    parts.table(
        ("Method", "Markers", "Error of the skin"),
        [(one.method, f"{one.markers}", f"{one.rmse_mm:.3f} mm") for one in scored],
    )
    return (scored,)


@app.cell(hide_code=True)
def carrigan():
    mo.md("""
    ## Carrigan et al. 2020: expressions against mu

    The smaller the share of its movement from which on a blendshape claims skin, the more expressions it takes.
    """)
    return


@app.cell
def expressions_against_mu(rig):
    counts = mu_sweep(rig, audit_rig(rig).used, PackingSettings(), (0.25, 0.3, 0.4))
    parts.table(
        ("Mu", "Fewest expressions", "At least, proved", "Algorithm 1", "Greedy"),
        [(f"{row.mu}", f"{row.minimum}", f"{row.bound:.0f}", f"{row.sequential}", f"{row.greedy}") for row in counts],
    )
    return (counts,)


@app.cell(hide_code=True)
def more():
    mo.md("""
    ## All figures

    `capture-plan notebook` opens the session; beside it lie `compact_landmarks`, `thin_shell` and `packing_error`,
    which draw all figures of the three papers on your data (`marimo run notebooks/thin_shell.py -- --rig RIG --take
    TAKE`).
    """)
    return


if __name__ == "__main__":
    app.run()
