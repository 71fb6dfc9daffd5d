import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="Markers for dense motion", css_file="notebook.css")

with app.setup:
    import marimo as mo

    from capture_plan import figures
    from capture_plan import notebooks_support as parts
    from capture_plan.audit.audit import audit_rig
    from capture_plan.evaluation.le2013 import claims as paper_claims
    from capture_plan.evaluation.le2013 import report as page
    from capture_plan.evaluation.le2013.evaluation_cache import cached_evaluation
    from capture_plan.layout.face import see_face
    from capture_plan.shell.take import face_take


@app.cell(hide_code=True)
def title(rig, sequence):
    mo.md(f"""
    # Markers for dense motion: {parts.markdown_plain(rig.name)}, {parts.markdown_plain(sequence.name)}

    Le, Zhu and Deng (2013) lay out markers for a recorded performance: skin bends between them like a thin shell, and
    the best places are those from which the shell comes nearest to every frame. Here is their evaluation on this
    take, their algorithm as published beside ours, which scores every move of a marker exactly.
    """)
    return


@app.cell
def rig_of_the_session():
    rig = parts.chosen_rig()
    sitter = figures.sit(rig)
    return rig, sitter


@app.cell
def take_of_the_session(rig):
    sequence = parts.chosen_take(rig)
    with parts.working():
        take = face_take(rig, sequence)
        face = see_face(rig, audit_rig(rig).used)
    return face, sequence, take


@app.cell
def people_of_the_session(rig):
    people = parts.other_people(rig)
    return (people,)


@app.cell
def how_many(take):
    knob = parts.marker_counts_knob(take)
    knob
    return (knob,)


@app.cell
def numbers_of_markers(knob):
    counts = knob.value
    return (counts,)


@app.cell
def evaluated(counts, face, people, take):
    with parts.working():
        found = cached_evaluation(take, face, counts, people)
    return (found,)


@app.cell(hide_code=True)
def about_the_claims():
    mo.md("""
    ## What holds on this take

    The paper's observations, each held against the numbers below, and what this take cannot teach.
    """)
    return


@app.cell
def claims(found):
    parts.sentence_list(found, paper_claims.claims, page.balance, lambda found: list(found.notes))
    return


@app.cell(hide_code=True)
def about_the_errors():
    mo.md("""
    ## Error against the number of markers

    All layouts bend the same shell, held at the same rim; only the places differ. Letters are layouts that people use,
    as many of their points as lie where the take moves.
    """)
    return


@app.cell
def errors(found):
    parts.figure_view(
        figures.error_against_markers(found),
        "Error over all frames and vertices, root mean square, markers measured without noise (Fig. 12).",
        name="error-against-markers",
    )
    return


@app.cell
def maps_of_methods(found, sitter, take):
    parts.figure_view(
        parts.maps_of_methods(sitter, take, found),
        f"Where the skin is missed with {found.counts[-1]} markers, one scale for all (the paper's Fig. 11).",
        name="maps-of-methods",
    )
    return


@app.cell
def maps_of_counts(found, sitter, take):
    parts.figure_view(
        parts.maps_of_counts(sitter, take, found),
        "Where the skin is missed by our layouts, by number of markers, one scale for all (Fig. 6).",
        name="maps-of-counts",
    )
    return


@app.cell(hide_code=True)
def about_both_views():
    mo.md("""
    ## The same layouts, asked about the rig

    A layout for one take may be blind to blendshapes that the take shows little of; a layout for the rig rebuilds the
    take less well. The table has both.
    """)
    return


@app.cell
def both_views(found):
    parts.views_table(found)
    return


@app.cell(hide_code=True)
def about_the_variants():
    mo.md("""
    ## What constraints cost

    Where the motion ends the skin is held still, or nothing is. Markers stand in mirrored pairs, or anywhere. Each
    layout is a part of the next, or stands for itself.
    """)
    return


@app.cell
def constraints(found, sitter, take):
    parts.figure_view(
        figures.constraints(sitter, take, found),
        "Without and with the rim held, and in pairs; held points blue, markers red (Figs. 4 and 5).",
        name="constraints",
    )
    return


@app.cell
def variants(found):
    parts.sentence_list(found, page.variants)
    return


@app.cell
def growing(found, sitter):
    parts.figure_view(
        parts.layouts_inside_the_next(sitter, found),
        "Each layout a part of the next, inherited markers red, new ones blue; below, layouts of their own (Fig. 7).",
        name="nested-layouts",
    )
    return


@app.cell(hide_code=True)
def about_other_people():
    mo.md("""
    ## From person to person

    A layout from some people, put onto another one. Open this notebook with `-- --rig PATH --take PATH --subject PATH`,
    the last as often as you like: recorded weights drive every rig with ARKit's names.
    """)
    return


@app.cell
def people_curves(found):
    parts.figure_view(
        figures.error_between_people(found),
        "Each person under a layout from the others (Fig. 10).",
        name="people",
    ) if found.subjects else None
    return


@app.cell
def people_numbers(found):
    parts.people_table(found) if found.subjects else None
    return


@app.cell
def about_people(found):
    parts.sentence_list(found, page.about_people)
    return


@app.cell
def from_all_people(found, sitter):
    parts.figure_view(
        figures.shared_layouts(sitter, found),
        "Layouts from all people together, on the first one (Fig. 8).",
        name="layouts-from-all",
    ) if found.subjects else None
    return


@app.cell(hide_code=True)
def about_the_published_algorithm():
    mo.md("""
    ## The published algorithm, move by move

    It starts at random and may go uphill; the paper keeps the best of ten starts.
    """)
    return


@app.cell
def iterations(found):
    parts.figure_view(
        figures.error_over_iterations(found),
        "Error after every move of a marker, five starts (Fig. 3).",
        name="descent",
    )
    return


@app.cell
def iterations_on_the_head(found, sitter):
    parts.figure_view(
        figures.layouts_over_iterations(sitter, found),
        "The first start: markers before an iteration green, after it red (Fig. 3).",
        name="iterations",
    )
    return


@app.cell(hide_code=True)
def about_frames_that_were_not_seen():
    mo.md("""
    ## Frames that the layout was not chosen from

    The take in five parts, each rebuilt by a layout from the other four.
    """)
    return


@app.cell
def folds(found):
    parts.figure_view(
        figures.error_on_unseen_frames(found),
        "Mean and standard deviation over the five parts (Fig. 13).",
        name="unseen-frames",
    )
    return


@app.cell(hide_code=True)
def about_simulations():
    mo.md("""
    ## Layouts that are known, looked for again

    Markers at random, each moved at random by up to 10 mm; the skin follows, and the search sees the skin alone. These
    are our figures, not those of the paper, whose layouts and displacements nobody has.
    """)
    return


@app.cell
def recovered(found, sitter, take):
    parts.figure_view(
        figures.recovered_layouts(sitter, take, found),
        "Simulated markers red, found ones green on top (Fig. 9); last by the published algorithm.",
        name="recovered",
    )
    return


@app.cell
def recoveries(found):
    parts.sentence_list(found, page.recoveries)
    return


@app.cell(hide_code=True)
def about_skinning():
    mo.md("""
    ## The take stored as markers

    With nothing held, as in the paper's Table 4. Corrections and key points are fitted to the very take that they are
    measured on: they say how small a take can be stored, not how well markers predict it.
    """)
    return


@app.cell
def stored(found):
    parts.skinning_table(found)
    return


@app.cell(hide_code=True)
def about_handles():
    mo.md("""
    ## Markers as handles

    Drag a marker in any frame: the skin follows as the shell bends, and keeps what the frame has of its own. All other
    markers hold (section 7.1).
    """)
    return


@app.cell
def named_markers(face, found):
    handles = parts.handles(face, found)
    return (handles,)


@app.cell
def handle(handles, take):
    hand = parts.handle_knobs(handles, take)
    hand
    return (hand,)


@app.cell
def dragged(hand, handles, take):
    parts.dragged_head(take, handles, hand)
    return


if __name__ == "__main__":
    app.run()
