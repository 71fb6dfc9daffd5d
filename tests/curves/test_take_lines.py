"""Takes that are no wide tables: long, between spaces, pairs, messages, packed: the same weights come out of each."""

import gzip
import json
from collections.abc import Callable

import pytest

from capture_plan.curves import long_table
from capture_plan.curves.face_cap import USUAL
from capture_plan.curves.messages import seconds
from capture_plan.errors import RigError
from capture_plan.sample import sample_rig
from tests.curves.test_take_dialects import NAMES, T, driven, read, table, weights

W = weights().tolist()
CELLS = [(t, name, x) for t, row in enumerate(W) for name, x in zip(NAMES, row, strict=True)]
HEAD = "=head#-21.4,-6.03,-6.12,0.15,0.05,0.77|rightEye#6.6,3.5,1.5|leftEye#6.6,-2.8,-0.3|"
TAG = 0xE3B0C442  # seconds since 1900


def each(titles: str, form: str) -> str:
    """A line for each weight of each frame."""
    return "\n".join([titles] * bool(titles) + [form.format(s=t / 60, t=t, n=n, x=x, p=100 * x) for t, n, x in CELLS])


def framed(line: Callable[[int, list[tuple[str, float]]], str]) -> str:
    """What `line` makes of each frame."""
    return "\n".join(line(t, list(zip(NAMES, row, strict=True))) for t, row in enumerate(W)) + "\n"


def pairs(form: str, between: str) -> Callable[[list[tuple[str, float]]], str]:
    """Names and weights in one line."""
    return lambda row: between.join(form.format(n=n, x=x) for n, x in row)


TEXTS = {
    "long": each("time,name,value", "{s:.4f},{n},{x}"),
    "long, per cent, semicolons": each("seconds;BlendShape;Weight", "{s:.4f};{n};{p:.1f}"),
    "long, decimal commas, semicolons": each("frame;time;shape;weight", '{t};{s:.4f};"{n}";{x}').replace(".", ","),
    "long, quoted": each('"time","name","value"', '{s:.4f},"{n}","{x}"'),
    "long, no titles, spaces": each("", "{s:.4f} {n} {x}"),
    "long, other columns": each("timestamp_s,index,category_name,score,face", "{s:.4f},7,{n},{x},0"),
    "long, sure": each("time,name,score,confidence", "{s:.4f},{n},{x},0.9{t}"),
    "long, value first": each("value,name,time", "{x},{n},{s:.4f}"),
    "long, by name": "\n".join(
        ["time,name,value", *(f"{t / 60:.4f},{n},{x}" for t, n, x in sorted(CELLS, key=lambda c: c[1]))]
    ),
    "long, each its own time": "\n".join(
        ["time,name,value", *(f"{t / 60 + NAMES.index(n) / 6e3:.5f},{n},{x}" for t, n, x in CELLS)]
    ),
    "spaces": table(weights(), delimiter=" "),
    "aligned": "\n".join("".join(f"{c:>16}" for c in line.split(",")) for line in table(weights()).splitlines()),
    "spaces, decimal commas": table(weights(), delimiter=" ", decimal=","),
    "names behind #": "# " + table(weights(), delimiter=" "),
    "names behind #, commas": "# made by hand\n# " + table(weights()),
    "equal signs": framed(lambda t, row: f"t={t / 60:.4f}, " + pairs("{n}={x}", ", ")(row)),
    "colons after a time": framed(lambda t, row: f"{t / 60:.4f} " + pairs("{n}:{x}", " ")(row)),
    "blocks": framed(lambda t, row: f"{{\ntime:{t / 60:.4f}\n" + pairs("{n}:{x}", "\n")(row) + "\n}"),
    "iFacialMocap, per cent of fractions": framed(
        lambda t, row: f"{t / 60:.4f} " + pairs("{n}={x}", "|")(row) + "|" + HEAD
    ),
    "VMC": framed(
        lambda t, row: (
            "\n".join(f'{t / 60:.4f} /VMC/Ext/Blend/Val ,sf "{n}" {x}' for n, x in row) + "\n/VMC/Ext/Blend/Apply"
        )
    ),
    "OSC": framed(
        lambda t, row: "\n".join(
            f"{TAG + t // 60:08x}.{int(t % 60 / 60 * 2**32):08x} /avatar/parameters/v2/{n} f {x}" for n, x in row
        )
    ),
    "a log": framed(lambda t, row: f"2026-05-01 12:00:{t / 60:07.4f} INFO face: " + pairs("{n}={x}", ", ")(row)),
    "in brackets": framed(lambda t, row: f"[{t / 60:.4f}] " + pairs("{n}={x}", "|")(row)),
    "Python": framed(lambda t, row: f"{{'time': {t / 60:.4f}, " + pairs("'{n}': {x}", ", ")(row) + "}"),
    "JSON in a text": framed(lambda t, row: json.dumps({"time": t / 60, **dict(row)})),
    "OSC as a program prints it": framed(
        lambda t, row: "\n".join(f"{t / 60:.4f} ('/VMC/Ext/Blend/Val', '{n}', {x})" for n, x in row)
    ),
    "packed": gzip.compress(table(weights()).encode()),
}


@pytest.mark.parametrize("kind", TEXTS)
def test_every_way_to_write_down_a_take_gives_the_same_weights(tmp_path, kind):
    take = read(tmp_path / "take.txt", TEXTS[kind])
    assert driven(take) == pytest.approx(weights(), abs=1e-9)
    assert driven(take, sample_rig().names).sum() == pytest.approx(weights().sum())  # and nothing else moves
    assert take.fps == pytest.approx(60, abs=0.1)


@pytest.mark.parametrize("mark", ["-", "&"])
@pytest.mark.parametrize("between", ["\n", ""])
def test_ifacialmocap_sends_whole_per_cents_and_what_is_no_weight_is_named(tmp_path, mark, between):
    texts = ["|".join(f"{n}{mark}{round(100 * x)}" for n, x in zip(NAMES, row, strict=True)) for row in W]
    take = read(tmp_path / "take.txt", between.join(f"trackingStatus{mark}1|{text}|{HEAD}" for text in texts))
    assert driven(take) == pytest.approx(weights(), abs=0.00501)
    assert any("head, leftEye, rightEye" in note for note in take.notes)


def test_small_per_cents_of_ifacialmocap_stay_per_cents(tmp_path):
    texts = [f"jawOpen-{t % 3}|eyeBlink_L-{t % 2}|{HEAD}" for t in range(T)]
    assert driven(read(tmp_path / "take.txt", "\n".join(texts))).max() == pytest.approx(0.02)


def test_face_cap_sends_the_number_of_each_name(tmp_path):
    rows = [f"{t / 60:.4f} /W {USUAL.index(n)} {x}" for t, n, x in CELLS if n in USUAL]
    took = driven(read(tmp_path / "take.txt", "\n".join(rows)))
    assert took[:, [n in USUAL for n in NAMES]] == pytest.approx(weights()[:, [n in USUAL for n in NAMES]])


LONG_JSON = {
    "one object for each": [{"timestamp": t / 60, "blendShapeLocation": n, "value": x} for t, n, x in CELLS],
    "k and v": [
        {
            "timestamp": t / 60,
            "FaceFound": True,
            "BlendShapes": [{"k": n, "v": x} for n, x in zip(NAMES, row, strict=True)],
        }
        for t, row in enumerate(W)
    ],
}


@pytest.mark.parametrize("kind", LONG_JSON)
@pytest.mark.parametrize("comma", ["", ","])
def test_json_with_an_object_for_each_weight_is_read_with_a_comma_too_much(tmp_path, kind, comma):
    take = read(tmp_path / "take.json", json.dumps(LONG_JSON[kind])[:-1] + comma + "]")
    assert driven(take) == pytest.approx(weights())
    assert take.fps == 60


def test_messages_without_a_weight_are_left_out_and_named(tmp_path):
    blend, bone = "/VMC/Ext/Blend/", "/VMC/Ext/Bone/Pos"
    bones = "".join(
        f'{bone} "Head" 0 0 0 {t}\n{blend}Val "jawOpen" 0.{t}\n{blend}Val "eyeBlinkLeft" 0.1\n{blend}Apply\n'
        for t in range(9)
    )
    take = read(tmp_path / "take.txt", bones)
    assert len(take.frames) == 9
    assert any("/VMC/Ext/Bone/Pos" in note for note in take.notes)


def test_weights_that_stand_twice_in_a_long_table_are_counted(tmp_path):
    text = each("time,name,value", "{s:.4f},{n},{x}")
    take = read(tmp_path / "take.csv", text + "\n" + text.splitlines()[1].rpartition(",")[0] + ",0.999")
    assert driven(take) == pytest.approx(weights())
    assert any(note.startswith("1 of its lines has the time and the name") for note in take.notes)


def test_rows_of_several_blocks_and_short_ones_come_to_their_frames(tmp_path, monkeypatch):
    monkeypatch.setattr(long_table, "BLOCK", 7)
    text = each("time,name,value", "{s:.4f},{n},{x}").splitlines()
    take = read(tmp_path / "take.csv", "\n".join([*text[:40], "0.1,jawOpen", *text[40:]]))
    assert driven(take) == pytest.approx(weights())
    assert any(note.startswith("1 of its lines holds too few") for note in take.notes)


def test_a_wide_table_with_a_column_of_words_is_no_long_one(tmp_path):
    rows = table(weights()).splitlines()
    words = [f"viseme,{rows[0]}", *(f"{'AEIOU'[t % 5]},{row}" for t, row in enumerate(rows[1:]))]
    assert driven(read(tmp_path / "take.csv", "\n".join(words))) == pytest.approx(weights())


def test_the_time_tag_of_osc_counts_seconds_and_their_parts():
    assert float(seconds("00000002.80000000")) == 2.5
    assert seconds("2.5") == "2.5"


@pytest.mark.parametrize(
    "content", [gzip.compress(b"time,jawOpen\n" * 99, mtime=0)[:-9], b"\x1f\x8bnothing"], ids=["cut off", "no gzip"]
)
def test_a_damaged_packed_take_is_refused_in_one_line(tmp_path, content):
    with pytest.raises(RigError, match="no whole gzip file") as error:
        read(tmp_path / "take.csv.gz", content)
    assert "\n" not in str(error.value)
