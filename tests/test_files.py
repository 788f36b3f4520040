"""Files that would take all memory or all time are refused before they are parsed, in a process with little memory."""

import io
import os
import subprocess
import sys
import zipfile
from functools import partial
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.patience import HANGS
from viscopade import files
from viscopade.fitting import read, spreadsheet
from viscopade.scene.read import from_toml

resource = pytest.importorskip("resource")

MEMORY = 1 << 30
ROWS = "speed,epsilon\n1,0.5\n2,0.4\n3,0.3\n"
PHYPHOX = Path(__file__).parent / "fitting/phyphox.xls"
SHEET = (
    '<worksheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"><sheetData>{}</sheetData></worksheet>'
)
RELATIONS = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
CELLS = (
    '<row r="1"><c r="A1" t="str"><v>speed</v></c><c r="B1" t="str"><v>epsilon</v></c></row>'
    '<row r="2"><c r="A2"><v>1</v></c><c r="B2"><v>0.5</v></c></row>'
)
ODS = (
    '<office:document-content xmlns:office="urn:oasis:names:tc:opendocument:xmlns:office:1.0" '
    'xmlns:table="urn:oasis:names:tc:opendocument:xmlns:table:1.0" '
    'xmlns:text="urn:oasis:names:tc:opendocument:xmlns:text:1.0"><office:body><office:spreadsheet>'
    '<table:table table:name="s">{}</table:table></office:spreadsheet></office:body></office:document-content>'
)
EMPTY = '<table:table-row table:number-rows-repeated="1000000"><table:table-cell/></table:table-row>'
FAR = '<table:table-row><table:table-cell table:number-columns-repeated="700"/>'
FAR += '<table:table-cell office:value="1"/></table:table-row>'


def archive(members):
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as packed:
        for name, text in members.items():
            packed.writestr(name, text)
    return made.getvalue()


def xlsx(cells, shared="<sst/>"):
    relations = '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">{}</Relationships>'
    relation = f'<Relationship Id="r1" Type="{RELATIONS}/{{}}" Target="{{}}"/>'
    workbook = (
        f'<workbook xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main" xmlns:r="{RELATIONS}">'
        '<sheets><sheet name="s" sheetId="1" r:id="r1"/></sheets></workbook>'
    )
    return archive(
        {
            "[Content_Types].xml": "<Types/>",
            "_rels/.rels": relations.format(relation.format("officeDocument", "xl/workbook.xml")),
            "xl/workbook.xml": workbook,
            "xl/_rels/workbook.xml.rels": relations.format(
                relation.format("worksheet", "worksheets/sheet1.xml")
                + relation.format("sharedStrings", "sharedStrings.xml").replace("r1", "r2")
            ),
            "xl/sharedStrings.xml": shared,
            "xl/worksheets/sheet1.xml": SHEET.format(cells),
        }
    )


def ods(rows):
    kind = "application/vnd.oasis.opendocument.spreadsheet"
    manifest = "<manifest:manifest xmlns:manifest='urn:oasis:names:tc:opendocument:xmlns:manifest:1.0'/>"
    return archive({"mimetype": kind, "META-INF/manifest.xml": manifest, "content.xml": ODS.format(rows)})


def text_row(text, repeated="1"):
    cell = f'<table:table-cell office:value-type="string"><text:p>{text}</text:p></table:table-cell>'
    return f'<table:table-row table:number-rows-repeated="{repeated}">{cell}</table:table-row>'


def shared_xlsx():
    """Many cells that name one long text: some 15 kB."""
    text = f"<sst><si><t>{'x' * 10_000_000}</t></si></sst>"
    cells = "".join(f'<row r="{i}"><c r="A{i}" t="s"><v>0</v></c></row>' for i in range(3, 300))
    return xlsx(CELLS + cells, text)


def far_xls():
    """The phyphox file, with its last cell moved to the last row and column that the format can name."""
    content = PHYPHOX.read_bytes()
    place = content.rfind(b"\xfd\x00\x0a\x00")
    return content[: place + 4] + b"\xff" * 4 + content[place + 8 :]


def damaged(content):
    return content[:60] + b"\xff" * 8 + content[68:]


HOSTILE = {
    "far.xlsx": (
        lambda: xlsx(CELLS + '<row r="1048576"><c r="ZZ1048576"><v>1</v></c></row>'),
        "expected smaller tables",
    ),
    "far.ods": (lambda: ods(EMPTY + FAR), "expected smaller tables"),
    "shared.xlsx": (shared_xlsx, "expected smaller tables"),
    "texts.ods": (lambda: ods(text_row("x" * 100_000, "100000")), "expected smaller tables"),
    "blanks.ods": (lambda: ods(text_row('<text:s text:c="2000000000"/>')), "expected smaller tables"),
    "word.ods": (lambda: ods(text_row("x", "many")), "the spreadsheet cannot be read"),
    "far.xls": (far_xls, "expected smaller tables"),
    "cells.csv": (lambda: ROWS + "," * 9_000_000, "expected at most 8388608 cells"),
    "lines.csv": (lambda: ROWS + "\n" * 9_000_000, "expected at most 8388608 cells"),
    "bomb.zip": (lambda: archive({f"{i}.csv": ROWS + "1,0.5\n" * 3_000_000 for i in range(8)}), "134217728 bytes"),
    "many.zip": (lambda: archive({f"{i}.csv": ROWS for i in range(1001)}), "1001 members: expected up to 1000"),
    "damaged.zip": (lambda: damaged(archive({"a.csv": ROWS * 50})), "the ZIP archive cannot be read"),
    "damaged.xlsx": (lambda: damaged(xlsx(CELLS)), "the ZIP archive cannot be read"),
    "entities.xlsx": (lambda: xlsx("&a;"), "no sheet has rows below a header"),
    "words.csv": (lambda: "speed,epsilon\n" + "a,b\n" * 1_000_000, "the unit of speed is 'a': expected m/s"),
    "headers.csv": (lambda: (("speed_" * 30 + ",") * 300 + "\n") * 1000, "speed (m/s), epsilon; or "),
    "attributes.ods": (
        lambda: ods(FAR.replace("<table:table-row>", '<table:table-row table:number-rows-repeated="9000000">') * 2),
        "attributes.ods: ",
    ),
    "blanks.csv": (lambda: "speed" + " " * 100_000 + "x(m/s,epsilon\n1,0.5\n", "the columns are 'speed "),
    "dots.toml": (lambda: "a." * 200_000 + "a = 1", "nested too deeply"),
    "quoted.toml": (lambda: 'x = {a = """\'"""", ' + "'b' . " * 100_000 + "c = 1}", "nested too deeply"),
    "lists.toml": (lambda: "a = " + "[" * 200_000, "nested too deeply"),
    "quotes.toml": (lambda: 'a = "' + '\\"' * 200_000, "the text is not TOML"),
    "long.toml": (lambda: "a = 1\n" * 200_000, "expected at most 1048576 bytes"),
}


def refusal(name):
    content = HOSTILE[name][0]()
    content = content.encode() if isinstance(content, str) else content
    try:
        from_toml(content, name) if name.endswith(".toml") else read.recording([(content, name)])
    except ValueError as error:
        return str(error)
    return "read"


@pytest.fixture(scope="module")
def said():
    """What a process with little memory says of each file, a line for each; the last one tells where it ended."""
    spreadsheets = find_spec("python_calamine") is not None
    names = [name for name in HOSTILE if spreadsheets or not name.endswith((".xls", ".xlsx", ".ods"))]
    code = f"from tests.test_files import refusal\nfor name in {names}: print(refusal(name), flush=True)"
    run = subprocess.run(
        [sys.executable, "-c", code],
        cwd=Path(__file__).parents[1],
        env=os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
        preexec_fn=partial(resource.setrlimit, resource.RLIMIT_AS, (MEMORY, MEMORY)),
        capture_output=True,
        text=True,
        timeout=HANGS,
    )
    assert run.returncode == 0, run.stdout + run.stderr
    return dict(zip(names, run.stdout.splitlines(), strict=True))


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_files_are_refused_in_little_memory(said, name):
    if name not in said:
        pytest.skip("there is no Python package python_calamine")
    assert said[name].startswith(f"{name}: ")
    assert HOSTILE[name][1] in said[name]


def test_spreadsheets_as_programs_write_them_are_read():
    """LibreOffice ends each sheet with a million empty rows of 16384 empty columns."""
    pytest.importorskip("python_calamine")

    def cell(value):
        kind = "string" if isinstance(value, str) else f'float" office:value="{value}'
        return f'<table:table-cell office:value-type="{kind}"><text:p>{value}</text:p></table:table-cell>'

    def table(*values):
        return "".join(f"<table:table-row>{''.join(map(cell, row))}</table:table-row>" for row in values)

    rows = [table(("speed", "epsilon"), row) for row in ((1, 0.5), (1, "0,5"), ("1,0", "0,5"), ("1,0", 0.5))]
    for content in (*(ods(each + EMPTY) for each in rows), xlsx(CELLS)):
        name = "a.ods" if b"opendocument" in content else "a.xlsx"
        assert read.recording([(content, name)]).points.epsilon.tolist() == [0.5]
    mixed = ods(table(("speed", "epsilon"), (1, 0.6), ("1,000", "0.5")))
    with pytest.raises(ValueError, match=r"line 3: '1,000' has a comma, line 3 has '0\.5'"):
        read.recording([(mixed, "a.ods")])


def test_a_title_may_have_dots_and_brackets():
    text = 'title = "a.b.c.d.e.f.g.h.i.j [[[[[[[[[[ \\" # x"  # a.b.c.d.e.f.g.h.i.j\n'
    text += "b = [1.5, 2.5, 3.5, 4.5, 5.5, 6.5, 7.5, 8.5, 9.5]"
    assert set(files.toml(text, "a.toml")) == {"title", "b"}


def test_a_spreadsheet_that_takes_too_long_is_refused(monkeypatch):
    pytest.importorskip("python_calamine")
    monkeypatch.setattr(spreadsheet, "SECONDS", 1e-3)
    with pytest.raises(ValueError, match=r"a\.xlsx: the spreadsheet cannot be read: it takes more than 0\.001 s"):
        read.recording([(xlsx(CELLS), "a.xlsx")])


def test_without_a_limit_of_memory_files_are_smaller(monkeypatch):
    pytest.importorskip("python_calamine")
    monkeypatch.setattr(files, "LIMITED", False)
    assert len(read.recording([(xlsx(CELLS), "a.xlsx")]).points) == 1
    with pytest.raises(ValueError, match=r"a\.xlsx: the content is too long: expected at most 16777216 bytes"):
        read.recording([(xlsx(CELLS, f"<sst><si><t>{'x' * 20_000_000}</t></si></sst>"), "a.xlsx")])


def test_a_pipe_without_a_writer_is_refused(tmp_path):
    os.mkfifo(tmp_path / "a.csv")
    with pytest.raises(ValueError, match=r"cannot read .*a\.csv: it is a pipe"):
        files.content(tmp_path / "a.csv", "CSV")


def test_cells_of_a_spreadsheet_that_are_no_numbers():
    """Times of day and thousands separators: '1,053' in a cell of text is 1053, or 1.053."""
    pytest.importorskip("python_calamine")
    words = '<table:table-cell office:value-type="string"><text:p>{}</text:p></table:table-cell>'
    clock = '<table:table-cell office:value-type="time" office:time-value="PT00H00M0{}S"/>'
    numbers = '<table:table-cell office:value-type="float" office:value="{}"/>'

    def rows(*cells):
        return "".join(f"<table:table-row>{row}</table:table-row>" for row in cells)

    times = rows(words.format("time"), *map(clock.format, (1, 2, 3)))
    with pytest.raises(ValueError, match=r"line 2: time is '.*1.*': expected a number"):
        read.recording([(ods(times), "a.ods")])
    heads = words.format("speed") + words.format("epsilon")
    table = rows(heads, *(words.format(f"1,{k}53") + numbers.format(0.9) for k in range(3)))
    with pytest.raises(
        ValueError, match=r"line 2: '1,053' has a comma, it may be 1053: expected no thousands separators"
    ):
        read.recording([(ods(table), "a.ods")])


def test_lines_of_a_spreadsheet_count_from_its_first_row():
    pytest.importorskip("python_calamine")
    content = xlsx(CELLS.replace('r="2"', 'r="7"').replace("A2", "A7").replace("B2", "B7").replace('1"', '4"'))
    assert read.recording([(content, "a.xlsx")]).points.labels == ("line 7",)
