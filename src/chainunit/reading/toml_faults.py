"""Faults of a text that is no TOML, each with its line and a remedy; tomllib gives only the first, in its own
words."""

from __future__ import annotations

import re
import tomllib

from ..core.errors import InputError, printable, shown

_PLACE = re.compile(r" \(at (?:line (\d+), column \d+|end of document)\)$")
_NAMED = r"\s*([\w.\"' -]*?)\s*=\s*"
_COMMA = re.compile(r"([+-−]?\d+),(\d+)(?!\d*,)(.*)")
_NUMBER = re.compile(r"([+-]?)0*(\d*)\.?(\d*)")
_QUOTES = "“”„«»‘’′″`"
_BARE = re.compile(_NAMED + r"([^\s\"'\[{#=][^\"#=]*?)\s*(?:#.*)?")
_BEGIN = re.compile(r"\[|[\w.\"' -]+=")
_HEADING = re.compile(r"\s*(\[\[?)\s*([^]\[]+?)\s*\]")
_DIGITS = re.compile(r"\d{4301,}")
_SWITCHES = {"true": "true", "yes": "true", "on": "true", "false": "false", "no": "false", "off": "false"}
_MOST = 50
"""Largest number of faults that are shown at once."""
_LONGEST = 500
"""Largest number of characters of a line whose value is checked."""


def syntax_faults(text: str, error: Exception) -> list[InputError]:
    """The faults of a text that tomllib refuses with `error`: the first, and those in other lines as far as each
    concerns its own line alone."""
    faults: list[InputError] = []
    lines = text.replace("\r\n", "\n").split("\n")
    while len(faults) < _MOST:
        line = _line(lines, error)
        value_fault = _value_fault(lines[line - 1]) if line else ""
        if faults and not value_fault:
            break
        faults.append(InputError(f"no valid TOML: {value_fault or _words(lines, line, error)}", line=line))
        if not value_fault:
            break
        lines[line - 1] = ""
        try:
            tomllib.loads("\n".join(lines))
        except (ValueError, RecursionError) as next_error:
            error = next_error
        else:
            break
    return faults


def _line(lines: list[str], error: Exception) -> int:
    """The line of the fault, from 1; 0 if it is not known."""
    place = _PLACE.search(str(error))
    if place is not None:
        return int(place[1]) if place[1] else len(lines)
    return next((k for k, line in enumerate(lines, 1) if _DIGITS.search(line)), 0)


def _value_fault(line: str) -> str:
    """The fault of the value in a line and its right form; empty if these are not clear."""
    match = _BARE.fullmatch(line) if len(line) <= _LONGEST else None
    if match is None or _is_value(match[2]):
        return ""
    key, value = match[1], match[2]
    cited = printable(match[0].partition("#")[0].strip(), 80)
    comma = _COMMA.fullmatch(value)
    value = f"{comma[1]}.{comma[2]}{comma[3]}" if comma else value
    if comma and not comma[3]:
        return f"{cited}: a number has a point: {key} = {value}"
    if switch := _SWITCHES.get(value.lower()):
        return f"{cited}: must be true or false: {key} = {switch}"
    number = _NUMBER.fullmatch(value)
    if number is not None and (number[2] or number[3]):
        decimals = f".{number[3]}" if number[3] else ""
        return f"{cited}: a number is written {key} = {number[1]}{number[2] or 0}{decimals}"
    kind = "a value with a unit" if value[0] in "+-−.0123456789" else "a text"
    return f"{cited}: {kind} stands in quotation marks: {key} = {shown(value.strip(_QUOTES))}"


def _is_value(text: str) -> bool:
    try:
        tomllib.loads(f"x = {text}")
    except ValueError:
        return False
    return True


def _words(lines: list[str], line: int, error: Exception) -> str:
    """Words on a fault that is not one of a value."""
    said = _PLACE.sub("", str(error))
    first = next(
        (stripped for stripped in map(str.strip, lines) if stripped and not stripped.startswith("#")), ""
    )
    if not _BEGIN.match(first) and not _kind(first):
        return "the file has no tables and keys, as a file in TOML has: [name], and below it key = value"
    faulty_line = lines[line - 1] if line else ""
    twice = any(word in said for word in ("Cannot", "Duplicate"))
    if twice and (heading := _HEADING.match(faulty_line)):
        return _twice(lines, line, heading)
    if twice:
        key = printable(faulty_line.partition("=")[0].strip(), 80)
        return f"{key} stands twice in its table; leave one of the two out"
    if _DIGITS.search(faulty_line):
        return "a number has more than 4300 digits"
    if faulty_line.count('"') == 1 or faulty_line.count("'") == 1:
        return f"{printable(faulty_line.strip(), 80)}: a quotation mark is missing"
    kind = _kind(first)
    cited = f"{printable(faulty_line.strip(), 80)}: " if faulty_line.strip() and not kind else ""
    return f"{cited}{printable(said[:1].lower() + said[1:])}{kind}"


def _kind(first: str) -> str:
    """Words on another kind of text, to follow a refusal, by its first line that is not empty."""
    if first.startswith("{"):
        return "; it is JSON"
    if max(first.count(","), first.count(";"), first.count("\t")) > 2:
        return "; it is a CSV table"
    return (
        "; it is YAML: a table begins with [name], and a key stands before =" if first.endswith(":") else ""
    )


def _twice(lines: list[str], line: int, heading: re.Match[str]) -> str:
    """The refusal of a second table of the same name."""
    begin, name = heading[1], heading[2]
    end = "]" * len(begin)
    for k, other in enumerate(lines[: line - 1], 1):
        first = _HEADING.match(other)
        if first is not None and first[2] == name:
            if first[1] != begin:
                return f"{begin}{name}{end} stands beside {first[0].strip()}{']' * (len(first[1]) - 1)} in line {k}"
            return f"[{name}] stands twice, first in line {k}; put the keys of both into one table"
    for k, other in enumerate(lines[: line - 1], 1):
        if _HEADING.match(other):
            break
        if re.match(rf"\s*{re.escape(name)}\s*=\s*[^{{\s]", other):
            advice = f"; [system] has the key {name} for a name" if name in ("machine", "motor") else ""
            return f"{begin}{name}{end} is a table, and line {k} sets {name} to a value{advice}"
    return f"{begin}{name}{end}: what is in it stands before already; put the keys of both into one table"
