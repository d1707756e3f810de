"""Ways to damage files and datagrams, at random and by design."""

import io
import re
import warnings
import zipfile
from collections.abc import Callable

import numpy as np

from drake_disasm.common.archive import Arrays, pack

Random = np.random.Generator

#: Nine lists of nine aliases each of the one before.
_BOMB = "a0: &a0 [x]\n" + "".join(
    f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]\n" for i in range(1, 10)
)
_WORDS = (
    *("1e400", "-1e300", "nan", ".nan", ".inf", "-1", "0", "true", "~", "''", "yes"),
    *("9" * 400, "9" * 5000, "0." + "1" * 300, "0x7fffffffffffffff", "1_000", "1:60"),
    *("[]", "{}", "[1, 2]", "[[1]]", "{a: 1}", "[" * 5000, "{a: " * 3000, "[~, {}]"),
    *("[" * 30 + "]" * 30, "[" + "0, " * 30_000 + "]", "2020-13-45", "2020-02-30"),
    *("!!timestamp x", "!!binary x", "!!int x", "!!bool 7", "!!float ''", "!!set 3"),
    *("!!python/object/apply:os.getcwd []", "!Unknown {}", "!SensorBias {}"),
    *("*a9", "&a [*a]", "&a {<<: *a}", "{<<: 3}", "? [a]", '"\\0"', '"\\ud800"'),
    *(
        "x" * 600,
        "x" * 20_000,
        "\t",
        "%",
        "@",
        "`",
        "|",
        ">",
        "- - -",
        "\x07",
        "\u2028",
    ),
)
_NUMBERS = (
    *("nan", "inf", "-inf", "1e300", "-1e300", "1e400", "", " ", "abc", "true", "0x1"),
    *("9" * 5000, '"', '"1,2"', "1;2", "1e", "--1", "\x00", "1.7e308", "5e-324"),
)
#: What stands between quotes, or between tags.
_IN_XML = re.compile(r'(?<=")[^"<>]*(?=")|(?<=>)[^<>]+(?=<)')
_XML_WORDS = (
    *("-1", "0", "999999999", "A0", "XFD1048576", "ZZZZ1", "1e400", "nan", "", "&#0;"),
    *("s", "e", "d", "b", "str", "inlineStr", "2024-01-01", "9" * 5000, "x" * 20_000),
)
_XML_BOMB = (
    '<!DOCTYPE x [<!ENTITY a0 "x">'
    + "".join(f'<!ENTITY a{i} "{f"&a{i - 1};" * 10}">' for i in range(1, 10))
    + "]>"
)


def damaged(data: bytes, rng: Random) -> bytes:
    """Returns bytes after one to four blind changes."""
    for _ in range(rng.integers(1, 5)):
        change = _CHANGES[rng.integers(len(_CHANGES))]
        data = change(data, rng)
    return data


def damaged_yaml(text: str, rng: Random) -> str:
    """Returns YAML after one to four changes of lines and values."""
    lines = text.splitlines()
    for _ in range(rng.integers(1, 5)):
        if not lines:
            break
        i = int(rng.integers(len(lines)))
        key, colon, _ = lines[i].partition(":")
        word = _WORDS[rng.integers(len(_WORDS))]
        change = rng.integers(8)
        if change < 4:
            lines[i] = f"{key}{colon or ':'} {word}"
        elif change == 4:
            lines[i] = f"{word}: {word}" if rng.integers(2) else f"{key}x{colon} 1"
        elif change == 5:
            lines.insert(int(rng.integers(len(lines) + 1)), lines[i])
        elif change == 6:
            lines[i] = " " * int(rng.integers(1, 9)) + lines[i]
        else:
            del lines[i]
    bomb = _BOMB if rng.integers(20) == 0 else ""
    return bomb + "\n".join(lines) + "\n"


def damaged_xml(text: str, rng: Random) -> str:
    """Returns XML after one to four changes of its attributes and texts."""
    for _ in range(rng.integers(1, 5)):
        places = list(_IN_XML.finditer(text))
        if not places:
            break
        place = places[rng.integers(len(places))]
        word = _XML_WORDS[rng.integers(len(_XML_WORDS))]
        text = text[: place.start()] + word + text[place.end() :]
    if rng.integers(20) == 0:
        head, end, rest = text.rpartition("?>")
        text = head + end + _XML_BOMB + rest.replace("<v>", "<v>&a9;", 1)
    return text


def damaged_workbook(data: bytes, rng: Random) -> bytes:
    """Returns a zip of XML files, one of which is damaged by design."""
    if rng.integers(3) == 0:
        return _rezipped(data, rng)
    buffer = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as old, zipfile.ZipFile(buffer, "w") as new:
        chosen = old.namelist()[rng.integers(len(old.namelist()))]
        for name in old.namelist():
            text = old.read(name).decode()
            if name == chosen or ("sheet" in name and rng.integers(2)):
                text = damaged_xml(text, rng)
            new.writestr(name, text.encode(errors="replace"))
    return buffer.getvalue()


def damaged_csv(text: str, rng: Random) -> str:
    """Returns a table in CSV after one to four changes of its cells, rows, columns."""
    rows = [line.split(",") for line in text.splitlines()]
    for _ in range(rng.integers(1, 5)):
        i = int(rng.integers(len(rows)))
        j = int(rng.integers(len(rows[i])))
        change = rng.integers(8)
        if change < 4:
            rows[i][j] = _NUMBERS[rng.integers(len(_NUMBERS))]
        elif change == 4:
            rows[i].insert(j, rows[i][j])
        elif change == 5 and len(rows[i]) > 1:
            del rows[i][j]
        elif change == 6:
            rows.insert(i, list(rows[int(rng.integers(len(rows)))]))
        elif len(rows) > 1:
            del rows[i]
    return "\n".join(map(",".join, rows)) + "\n"


def damaged_columns(columns: Arrays, rng: Random) -> dict[str, object]:
    """Returns a table's columns after one to three changes of type, values or name."""
    changed: dict[str, object] = dict(columns)
    for _ in range(rng.integers(1, 4)):
        names = list(changed)
        name = names[rng.integers(len(names))]
        values, rows = columns.get(name, np.zeros(3)), len(columns["rows"])
        options: tuple[Callable[[], object], ...] = (
            lambda v=values: v.astype(str),
            lambda v=values: v.astype(np.float32),
            lambda v=values: v.astype("int8"),
            lambda v=values: v.astype(bool),
            lambda v=values: np.full(len(v), rng.choice(_EXTREMES)),
            lambda v=values: [[x] for x in v.tolist()],
            lambda v=values: [{"x": x} for x in v.tolist()],
            lambda v=values: [None, *v.tolist()[1:]],
            lambda v=values: v.astype("datetime64[s]") if v.dtype != bool else v,
            lambda v=values: np.roll(v, 1),
        )
        choice = int(rng.integers(len(options) + 2))
        if choice < len(options):
            changed[name] = options[choice]()
        elif choice == len(options) and len(changed) > 2:
            del changed[name]
        else:
            changed[f"{name}x"] = np.zeros(rows)
    changed.pop("rows", None)
    return changed


def damaged_archive(arrays: Arrays, text: dict[str, object], rng: Random) -> bytes:
    """Returns an archive with a right checksum and wrong content, or the reverse."""
    arrays, text = {n: a.copy() for n, a in arrays.items()}, dict(text)
    for _ in range(rng.integers(1, 4)):
        names = list(arrays)
        name = names[rng.integers(len(names))]
        with np.errstate(all="ignore"), warnings.catch_warnings(action="ignore"):
            _change_array(arrays, name, rng)
        if rng.integers(3) == 0 and text:
            _change_text(text, rng)
    data = pack(arrays, text)
    return _rezipped(data, rng) if rng.integers(4) == 0 else data


def _change_array(arrays: Arrays, name: str, rng: Random) -> None:
    values = arrays[name]
    if values.dtype.kind not in "biuf":  # NumPy's own casts of those may crash
        values = np.zeros(values.shape)
    change = rng.integers(9)
    if change < 3:
        kinds = ("f2", "f4", "f8", "i4", "u1", "?", "U3", "S2", "c8", "M8[s]", ">f4")
        arrays[name] = values.astype(kinds[rng.integers(len(kinds))])
    elif change == 3:
        arrays[name] = values.reshape(-1)[: rng.integers(values.size + 1)]
    elif change == 4:
        arrays[name] = np.asfortranarray(values[..., None])
    elif change == 5 and values.size and values.dtype.kind == "f":
        values.flat[rng.integers(values.size)] = rng.choice(_EXTREMES)
    elif change == 6:
        arrays[f"{name}x"] = values
    elif change == 7 and len(arrays) > 1:
        del arrays[name]
    else:
        arrays["spam" * int(rng.integers(1, 100))] = np.zeros(int(rng.integers(5)))


def _change_text(text: dict[str, object], rng: Random) -> None:
    """Changes an entry somewhere in the text."""
    key = list(text)[rng.integers(len(text))]
    if isinstance(text[key], dict) and text[key] and rng.integers(4):
        inner = dict(text[key])  # type: ignore[call-overload]
        _change_text(inner, rng)
        text[key] = inner
        return
    nested: object = []
    for _ in range(rng.choice((1, 500))):
        nested = [nested]
    odd = (None, -1, 10**30, 1e300, float("nan"), "", "x" * 10**4, [], {}, True, nested)
    text[key] = odd[rng.integers(len(odd))]
    if rng.integers(4) == 0:
        del text[key]


def _rezipped(data: bytes, rng: Random) -> bytes:
    """Returns the same members in another zip: compressed, twice, renamed, lied of."""
    buffer = io.BytesIO()
    how = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)[rng.integers(2)]
    with (
        zipfile.ZipFile(io.BytesIO(data)) as old,
        zipfile.ZipFile(buffer, "w") as new,
    ):
        for entry in old.infolist():
            content = old.read(entry)
            name = f"{entry.filename}{'x' * int(rng.integers(20) == 0)}"
            content = damaged(content, rng) if rng.integers(5) == 0 else content
            new.writestr(zipfile.ZipInfo(name), content, how)
        for entry in new.infolist():
            if rng.integers(10) == 0:
                entry.file_size = int(rng.integers(2**40))
    return buffer.getvalue()


def _flipped(data: bytes, rng: Random) -> bytes:
    if not data:
        return data
    changed = bytearray(data)
    for place in rng.integers(len(data), size=rng.integers(1, 9)):
        changed[place] ^= 1 << int(rng.integers(8))
    return bytes(changed)


def _cut(data: bytes, rng: Random) -> bytes:
    return data[: rng.integers(len(data) + 1)]


def _inserted(data: bytes, rng: Random) -> bytes:
    place = rng.integers(len(data) + 1)
    return data[:place] + rng.bytes(int(rng.integers(1, 65))) + data[place:]


def _repeated(data: bytes, rng: Random) -> bytes:
    a, b = sorted(rng.integers(len(data) + 1, size=2))
    return data[:b] + data[a:b] * int(rng.integers(1, 4)) + data[b:]


def _swapped(data: bytes, rng: Random) -> bytes:
    a, b, c = sorted(rng.integers(len(data) + 1, size=3))
    return data[:a] + data[b:c] + data[a:b] + data[c:]


def _blotted(data: bytes, rng: Random) -> bytes:
    a, b = sorted(rng.integers(len(data) + 1, size=2))
    return data[:a] + bytes([int(rng.choice((0, 32, 255)))]) * int(b - a) + data[b:]


_CHANGES = (_flipped, _flipped, _cut, _inserted, _repeated, _swapped, _blotted)
_EXTREMES = (np.nan, np.inf, -np.inf, 1e300, -1e200, 0.0, 5e-324, -1.0)
