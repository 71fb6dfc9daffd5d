"""How the fonts of East Asian names in this folder were made: `python rebuild.py FOLDER`.

FOLDER holds NotoSansJP_400Regular.ttf, NotoSansSC_400Regular.ttf and NotoSansKR_400Regular.ttf of the npm packages
@expo-google-fonts/noto-sans-jp, -sc and -kr 0.4.3 (SIL Open Font License 1.1, NOTO-LICENSE beside this file). Each is
cut down to the characters that names use, without hints and layout tables:

Japanese   the kana, punctuation, forms and signs of JIS X 0208, its kanji of level 1, and the words of our tables
Chinese    what GB 2312 level 1 (simplified) and Big5 level 1 (traditional) hold beyond those
Korean     the syllables of KS X 1001 and single letters
"""

import sys
from pathlib import Path

from fontTools import subset

HERE = Path(__file__).parent
LATIN = frozenset(map(chr, range(0x250)))
WORDS = HERE.parents[1] / "rig" / "data" / "movements.toml"


def rows(codec: str, first: int, last: int) -> frozenset[str]:
    """Characters in these rows of a 94 by 94 standard."""
    cells = (bytes((row + 0xA0, cell + 0xA0)) for row in range(first, last + 1) for cell in range(1, 95))
    return frozenset("".join(cell.decode(codec, "ignore") for cell in cells))


def big5_level_1() -> frozenset[str]:
    """The 5,401 common characters of Big5."""
    trails = [*range(0x40, 0x7F), *range(0xA1, 0xFF)]
    cells = (bytes((lead, trail)) for lead in range(0xA4, 0xC7) for trail in trails)
    return frozenset("".join(cell.decode("big5", "ignore") for cell in cells))


def characters() -> dict[str, frozenset[str]]:
    """What each font is cut down to, by the letters of its file."""
    forms = frozenset(map(chr, [*range(0x3000, 0x3100), *range(0xFF01, 0xFFA0)]))
    korean = rows("euc_kr", 16, 40) | frozenset(map(chr, range(0x3131, 0x318F)))
    japanese = (rows("euc_jp", 1, 8) | rows("euc_jp", 16, 47) | forms) - LATIN
    chinese = (rows("gb2312", 16, 55) | big5_level_1()) - japanese - LATIN
    words = frozenset(WORDS.read_text(encoding="utf-8")) - LATIN - korean - japanese - chinese
    return {"JP": japanese | words, "SC": chinese | words, "KR": korean}


def cut(source: Path, wanted: frozenset[str], made: Path) -> None:
    """Write `source` with no more than the `wanted` characters."""
    options = subset.Options(hinting=False, layout_features=[], glyph_names=False, notdef_outline=True)
    options.drop_tables += ["GSUB", "GPOS", "GDEF", "BASE", "STAT", "vhea", "vmtx"]
    font = subset.load_font(str(source), options)
    subsetter = subset.Subsetter(options)
    subsetter.populate(unicodes=[ord(character) for character in wanted])
    subsetter.subset(font)
    subset.save_font(font, str(made), options)


def main(folder: Path) -> None:
    """Write the three fonts beside this file."""
    for language, wanted in characters().items():
        cut(folder / f"NotoSans{language}_400Regular.ttf", wanted, HERE / f"NotoSans{language}-Regular.ttf")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
