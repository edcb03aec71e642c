"""Numbered sequences, wildcards and the order of names."""

from __future__ import annotations

from pathlib import Path

import pytest

from passgraph.errors import InputError
from passgraph.files.names import Pattern, folder_files, glob_files, in_order, missing_numbers
from tests.files.made import sequence


@pytest.mark.parametrize("text", ["shot.%04d.exr", "shot.####.exr"])
def test_both_ways_to_write_a_number(text: str) -> None:
    assert Pattern.is_in(text)
    assert Pattern(text).path(12) == Path("shot.0012.exr")
    assert Pattern(text).path(123456) == Path("shot.123456.exr")


@pytest.mark.parametrize(
    ("text", "name", "number"),
    [
        ("a%d.png", "a12.png", 12), ("a%d.png", "a012.png", None), ("a%d.png", "a-1.png", -1),
        ("a%d.png", "a².png", None), ("a##.png", "a7.png", None), ("a##.png", "a007.png", None),
        ("a##.png", "a100.png", 100), ("a##.png", "b07.png", None), ("a#a", "a1a", 1), ("aa#a", "aa", None),
        ("#.png", "9" * 30 + ".png", None), ("a%04d.png", "a-012.png", -12), ("a####.png", "a-0012.png", -12),
        ("a%d.png", "a-0.png", None), ("a%d.png", "a--1.png", None), ("a##.png", "a-.png", None),
        ("a%04d.png", "a-12.png", None), ("a%d.png", "a-12.png", -12),
    ],
)  # fmt: skip
def test_which_names_belong_to_a_sequence(text: str, name: str, number: int | None) -> None:
    assert Pattern(text).number(name) == number


@pytest.mark.parametrize("text", ["plain.png", "a%d.b%d.png", "a#.b#.png", "folder#/a.png", "50%.png"])
def test_what_is_no_sequence(text: str) -> None:
    assert not Pattern.is_in(text)


def test_files_come_in_the_order_of_their_numbers(tmp_path: Path) -> None:
    for number in (9, 10, 100, 1):
        (tmp_path / f"a{number}.png").touch()
    assert list(Pattern(str(tmp_path / "a%d.png")).files()) == [1, 9, 10, 100]
    assert [path.name for path in folder_files(tmp_path)] == ["a1.png", "a9.png", "a10.png", "a100.png"]
    assert [path.name for path in glob_files(f"{tmp_path}/a1*.png")] == ["a1.png", "a10.png", "a100.png"]


def test_digits_that_are_no_numbers_sort_too() -> None:
    names = ["a²", "a2", "b", "a10", "a02", ""]
    assert sorted(map(str, in_order(map(Path, names)))) == sorted(str(Path(name)) for name in names)


def test_a_sequence_tells_its_gaps() -> None:
    assert missing_numbers([3, 4, 6, 10]) == "5, 7-9"
    assert missing_numbers(range(5)) == missing_numbers([]) == ""


def test_nothing_found_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no file has such a name; check the folder and the digits"):
        Pattern(str(tmp_path / "a.####.png")).files()
    with pytest.raises(InputError, match=r"no file has such a name; check the wildcard"):
        glob_files(str(tmp_path / "*.png"))
    with pytest.raises(InputError, match=r"has no pictures and no videos; expected files such as \.png"):
        folder_files(tmp_path)
    with pytest.raises(InputError, match=r"the folder .* cannot be read \(No such file"):
        Pattern(str(tmp_path / "none" / "a.####.png")).files()


def test_hidden_files_and_folders_are_left_out(tmp_path: Path) -> None:
    sequence(tmp_path, [1])
    (tmp_path / ".passgraph-1.png").touch()
    (tmp_path / "folder.png").mkdir()
    assert [path.name for path in folder_files(tmp_path)] == ["in.0001.png"]


def test_negative_numbers_are_frames_before_the_others(tmp_path: Path) -> None:
    pattern = Pattern(str(tmp_path / "a.%04d.png"))
    for number in (3, -10, 0, -9):
        pattern.path(number).touch()
    assert list(pattern.files()) == [-10, -9, 0, 3]
    assert missing_numbers(pattern.files()) == "-8--1, 1-2"
