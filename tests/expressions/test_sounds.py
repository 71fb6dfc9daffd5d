"""Mouth shapes for sounds are asked for by the sound, and no two expressions read alike."""

from dataclasses import replace

import numpy as np

from capture_plan.anatomy.kinds import expression_kinds
from capture_plan.check.sentence_claims import MILLIMETRES
from capture_plan.expressions.sentences import distinct_sentences, sentence
from capture_plan.expressions.sounds import sounds_of
from capture_plan.face.anchors import face_anchors
from capture_plan.sample import sample_rig


def renamed(**new: str):
    """The sample with other names for some blendshapes."""
    rig = sample_rig()
    return replace(rig, names=tuple(new.get(name, name) for name in rig.names))


def test_a_viseme_is_asked_for_by_its_sound_and_by_how_it_moves():
    rig = renamed(mouthFunnel="viseme_O", mouthDimpleLeft="viseme_SS")
    assert "say 's' as in 'see'" in sentence(rig, ("viseme_SS",)).lower()
    assert "say 'oh' as in 'go'" in sentence(rig, ("viseme_O",)).lower()
    assert MILLIMETRES.search(sentence(rig, ("viseme_O",)))


def test_letters_are_sounds_only_where_several_are():
    assert sounds_of(renamed(jawOpen="aa")) == {}
    assert set(sounds_of(renamed(jawOpen="aa", mouthFunnel="ou", mouthPucker="oh"))) == {"aa", "ou", "oh"}


def test_what_moves_the_brows_is_no_sound():
    assert sounds_of(renamed(browInnerUp="viseme_E")) == {}


def test_a_sound_is_where_the_squares_of_the_motion_are_though_more_skin_moves_elsewhere():
    rig = renamed(mouthFunnel="viseme_O")
    low = rig.neutral[:, 1] < face_anchors(sample_rig()).between_y
    above, lips = np.flatnonzero(rig.skin & ~low), np.flatnonzero(rig.skin & low)[:20]
    deltas, k = rig.deltas.copy(), rig.names.index("viseme_O")
    deltas[k] = 0
    deltas[k, above, 1] = 1
    deltas[k, lips, 1] = np.sqrt(2 * len(above) / len(lips))
    assert len(lips) * deltas[k, lips, 1].max() < len(above)
    assert set(sounds_of(replace(rig, deltas=deltas))) == {"viseme_O"}


def test_arkits_names_are_no_sounds():
    assert sounds_of(sample_rig()) == {}


def test_expressions_that_would_read_alike_say_how_they_move():
    rig = sample_rig()
    k, j = rig.names.index("mouthPucker"), rig.names.index("mouthFunnel")
    deltas = rig.deltas.copy()
    deltas[j] = 0.5 * deltas[k]
    rig = replace(rig, deltas=deltas, meanings=(("mouthFunnel", "mouthPucker"),))
    said = distinct_sentences(rig, [("mouthPucker",), ("mouthFunnel",), ("browInnerUp",)])
    assert len(set(said)) == 3
    assert "It moves" in said[0]
    assert "It moves" in said[1]
    assert said[2] == sentence(rig, ("browInnerUp",))


def test_a_mix_names_parts_that_are_planned():
    """A part that is there twice goes by the first, which the plan keeps."""
    rig = sample_rig()
    a, b = (rig.names.index(name) for name in ("browDownLeft", "mouthSmileRight"))
    extra = np.stack([rig.deltas[b] * 0.8, rig.deltas[a] * 0.5 + rig.deltas[b] * 0.5])
    rig = replace(rig, deltas=np.concatenate([rig.deltas, extra]), names=(*rig.names, "copy", "mix"))
    mix = expression_kinds(rig)[-1]
    assert mix.kind == "calls others"
    assert "copy" not in mix.why
    assert "mouthSmileRight" in mix.why
