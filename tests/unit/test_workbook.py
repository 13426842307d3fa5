import io
import time

from openpyxl import load_workbook

from gripwright.report.workbook import bom_workbook

ROWS = [
    {"gripper": "G1", "model": "=1+1", "quantity": 2, "mass_kg": None, "operations": ["a", "b"]},
    {"gripper": "G1", "model": "M\x07", "quantity": 1, "mass_kg": 0.5, "operations": []},
]


def test_the_rows_stand_below_their_header_and_nothing_is_a_formula() -> None:
    sheet = load_workbook(io.BytesIO(bom_workbook({"BOM": ROWS})))["BOM"]

    assert list(sheet.iter_rows(values_only=True)) == [
        ("gripper", "model", "quantity", "mass_kg", "operations"),
        ("G1", "'=1+1", 2, None, "a; b"),
        ("G1", "M", 1, 0.5, None),
    ]


def test_the_same_rows_give_the_same_bytes_at_any_time() -> None:
    first = bom_workbook({"BOM": ROWS})
    time.sleep(2.1)  # an archive counts time in steps of two seconds

    assert bom_workbook({"BOM": ROWS}) == first


def test_no_rows_give_an_empty_sheet() -> None:
    assert load_workbook(io.BytesIO(bom_workbook({"BOM": []})))["BOM"].max_row == 1
