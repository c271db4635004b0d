"""Lines of the keys in a TOML text."""

import tomllib

from hypothesis import given, settings
from hypothesis import strategies as st

from chainunit.reading.toml_lines import lines_of, statements

ODD = '''title = "a\u2028b"   # a separator of lines in a text, and \u0085 in a comment
[m]
x = [ # a list
 1, # ]
 2 ]
y = """
z = 3
"""
inner = { a = 1, b = { c = 2 } }
d.e = 4
[[event]]
type = "jam"
[[event]]
type = "dip"
[event.more]
f = 1
'''


def test_odd_texts():
    assert tomllib.loads(ODD)
    lines = lines_of(ODD)
    assert {name: lines[name] for name in ("title", "m", "m.x", "m.y", "m.inner.b.c", "m.d.e")} == {
        "title": 1, "m": 2, "m.x": 3, "m.y": 6, "m.inner.b.c": 9, "m.d.e": 10,
    }  # fmt: skip
    assert (lines["event.1.type"], lines["event.2"], lines["event.2.type"]) == (12, 13, 14)
    assert lines["event.2.more.f"] == 16 and "m.z" not in lines


def test_line_ends_of_windows():
    assert lines_of(ODD.replace("\n", "\r\n")) == lines_of(ODD)


def test_a_list_of_many_lines_is_one_statement():
    text = "a = [\n" + "".join(f"  {k},\n" for k in range(3000)) + "]\nb = 3\n"
    assert [(each.line, each.last, each.keys) for each in statements(text)] == [
        (1, 3002, ("a",)),
        (3003, 3003, ("b",)),
    ]


@settings(deadline=None)
@given(
    st.lists(st.sampled_from(["", "# [x]", "a{} = 1", "[t{}]", "b{} = '''\n[no]\n'''", "c{} = [\n1,\n2]"]))
)
def test_each_statement_stands_where_it_is_written(pieces):
    text = "\n".join(piece.format(k) for k, piece in enumerate(pieces))
    for each in statements(text):
        own = "\n".join(text.split("\n")[each.line - 1 : each.last])
        data = tomllib.loads(own)
        assert list(data) == [(each.keys[0] if each.keys else each.table).split(".")[-1]]
