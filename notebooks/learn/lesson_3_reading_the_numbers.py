import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="3 Reading the numbers", css_file="../notebook.css")

with app.setup:
    import marimo as mo
    import numpy as np

    from capture_plan import LayoutSettings, sample_rig
    from capture_plan import notebooks_support as parts
    from capture_plan.layout.design import design_layout
    from capture_plan.layout.face import see_face
    from capture_plan.layout.predict import performances, predictions


@app.cell(hide_code=True)
def title():
    mo.md("""
    # 3 Reading the numbers

    A plan says how many mixes of blendshapes its landmarks tell apart, by how much noise grows, and what error of the
    skin is to be expected. Change the noise and take landmarks away: see which number moves, and which does not.
    """)
    return


@app.cell
def designed():
    face = see_face(sample_rig())
    layout = design_layout(face, LayoutSettings(method="budget", budget=34))
    vertices = np.array([landmark.vertex for landmark in layout.landmarks])
    return face, vertices


@app.cell
def knobs(vertices):
    noise = mo.ui.slider(0.1, 1.0, 0.1, value=0.2, label="Noise of a measured landmark, mm", show_value=True)
    left = mo.ui.slider(8, len(vertices), 1, value=len(vertices), label="Landmarks left", show_value=True)
    mo.vstack([noise, left])
    return left, noise


@app.cell
def measured(face, left, noise, vertices):
    observation = face.observation(noise.value)
    at = vertices[: left.value]
    information = observation.information(at)
    expected = predictions(observation, at, performances(observation, None))
    return expected, information


@app.cell
def figures(expected, information):
    parts.table(
        ("Number", "Here", "What it says"),
        [
            (
                "Rank",
                f"{information.rank} of {information.full_rank}",
                "Mixes of blendshapes that the landmarks tell apart. Below the full number some movements look alike.",
            ),
            (
                "Condition",
                f"{information.condition:.0f}",
                "How many times more noise grows in the worst mix than in the best. It does not depend on the noise.",
            ),
            (
                "Upper estimate",
                f"{information.error_mm:.3f} mm",
                "Mean error of the skin where weights may have any size. It grows with the noise.",
            ),
            *(
                (
                    f"Predicted error, {one.performance}",
                    f"{one.error_mm:.3f} mm, {one.low_mm:.3f} to {one.high_mm:.3f} in 90 % of frames",
                    "Error of the skin to expect where weights are solved between 0 and 1, as solvers do.",
                )
                for one in expected
            ),
        ],
    )
    return


@app.cell(hide_code=True)
def about_bounds():
    mo.md("""
    ## What "proved" means

    A **bound** is a number that no layout can beat. *12 landmarks, at least 12 proved* says that nobody will find 11
    under the same constraints. Where the two numbers differ, the truth lies between them. A bound carries a
    **certificate**: numbers from which anybody computes it again without a solver. `capture-plan check` does, and so
    does `verify_plan.py`, which knows nothing of this package.
    """)
    return


@app.cell(hide_code=True)
def all_words():
    mo.vstack([mo.md("## All words"), parts.word_list()])
    return


if __name__ == "__main__":
    app.run()
