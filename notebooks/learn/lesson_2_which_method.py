import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="2 Which method when", css_file="../notebook.css")

with app.setup:
    import marimo as mo

    from capture_plan import LayoutSettings, PackingSettings, audit_rig, sample_rig
    from capture_plan import notebooks_support as parts
    from capture_plan.expressions.pack import pack
    from capture_plan.layout.design import design_layout
    from capture_plan.layout.face import see_face

    LANDMARKS = {
        "studio": "You do not know how many markers you need. The default.",
        "cover": "You want the fewest markers that reach every blendshape, with the proof; the solver has priors.",
        "adaptive": "You want the multi-cover of Zell & McDonnell 2022, to compare with the paper.",
        "budget": "You know how many markers there is time for, and want the least error from them.",
        "motion": "You have a recorded take of this face and want to lose least of it.",
    }
    EXPRESSIONS = {
        "early": "The session may be cut short: what is scanned first counts most. The default.",
        "minimum": "You want the fewest expressions, those of most importance first, with the proof.",
        "sequential": "You want Algorithm 1 of Carrigan et al. 2020, to compare with the paper.",
        "greedy": "You want a baseline.",
    }


@app.cell(hide_code=True)
def title():
    mo.md("""
    # 2 Which method when

    Two choices shape a plan: how landmarks are chosen and how expressions are packed. Both have a default that is
    right where nothing speaks against it. The tables show what each method does on the bundled head.
    """)
    return


@app.cell
def head():
    rig = sample_rig()
    used = audit_rig(rig).used
    face = see_face(rig)
    return face, rig, used


@app.cell
def layouts(face):
    asked = {name: {"budget": 34} if name == "budget" else {} for name in LANDMARKS if name != "motion"}
    designed = {name: design_layout(face, LayoutSettings(method=name, **more)) for name, more in asked.items()}
    return (designed,)


@app.cell
def landmark_methods(designed):
    def figures(name):
        if name not in designed:
            return "needs a take", ""
        layout = designed[name]
        return f"{len(layout.landmarks)}", f"{layout.predictions[0].error_mm:.3f} mm"

    parts.table(
        ("Method", "Choose it when", "Landmarks", "Predicted error"),
        [(f"--method {name}", when, *figures(name)) for name, when in LANDMARKS.items()],
    )
    return


@app.cell
def lists(rig, used):
    packed = {name: pack(rig, used, PackingSettings(method=name)) for name in EXPRESSIONS}
    return (packed,)


@app.cell
def expression_methods(packed):
    parts.table(
        ("Method", "Choose it when", "Expressions", "Shown after five"),
        [
            (f"--expressions {name}", when, f"{packed[name].objective}", f"{packed[name].expressions[4].covered:.0%}")
            for name, when in EXPRESSIONS.items()
        ],
    )
    return


@app.cell(hide_code=True)
def words():
    parts.word_list(("set cover", "multi-cover", "predicted error", "importance", "bound"))
    return


if __name__ == "__main__":
    app.run()
