"""Drawings of other programs: linkages of `drawings` in each format against an independent solution, machines with a
known motion, what cannot be carried over, and the command."""

from __future__ import annotations

import math
import time
import tomllib
from pathlib import Path

import numpy as np
import pytest
from command import chainunit
from drawings import DENSITY, random_drawing
from multibody import Multibody

from chainunit.core.errors import InputError
from chainunit.machines.linkages.file import read_linkage
from chainunit.machines.linkages.imports.source import imported
from chainunit.machines.machine import Machine

NUMBERS = [*range(10), *(pytest.param(k, marks=pytest.mark.slow) for k in range(10, 40))]


def written(folder, text, name="drawing.linkage2"):
    file = folder / name
    file.write_text(text, "utf-8")
    return str(file)


def machine(source, **options):
    return Machine(imported(source, **options).machine()[0])


def refusal(source, **options):
    with pytest.raises(InputError) as caught:
        imported(source, **options).machine()
    return str(caught.value)


@pytest.mark.stages(first=3)
@pytest.mark.parametrize("number", NUMBERS)
def test_a_random_linkage_against_an_independent_solution(number, tmp_path):
    """Places of all pins, and the torque with weights and a force, to 1e-11 at five angles of the crank."""
    drawn, form = random_drawing(number)
    text, scale, pins, links = getattr(drawn, form)()
    source = text if form == "pmks" else written(tmp_path, text, f"drawing.{form}")
    model = machine(source, density=f"{DENSITY} kg/m")
    body = Multibody(drawn.description(scale, form == "linkage2", form == "pmks"))
    for q in (0.0, 1.1, 2.7, -1.9, -3.3):
        found = model.evaluate({"phi": q, "w": 3.0, "a": -7.0})
        wanted = body.solution(body.followed(q), q, 3.0, -7.0)
        for link, names in drawn.links.items():
            for pin in names:
                for axis in "xy":
                    place = float(found[f"{links[link]}.{pins[pin]}.{axis}"])
                    assert place == pytest.approx(wanted[f"{link}.{pin}.{axis}"], abs=1e-11), (q, link, pin)
        assert float(found["tau"]) == pytest.approx(wanted["tau"], rel=1e-11, abs=1e-12), q


SLIDER_CRANK = """<linkage2>
\t<program zoom="1.300000" xoffset="890" yoffset="618" scalefactor="1.000000" units="Millimeters" viewlayers="17"/>
\t<connector id="0" selected="true" layer="17" x="0.000000" y="0.000000" anchor="true" input="true" rpm="-40"/>
\t<connector id="1" layer="16" x="0.000000" y="30.000000" color="1"/>
\t<connector id="2" layer="16" x="117.260394" y="20.000000" slider="true" color="2">
\t\t<slidelimit id="3"/>
\t\t<slidelimit id="4"/>
\t</connector>
\t<connector id="3" layer="16" x="50" y="20" anchor="true"/>
\t<connector id="4" layer="16" x="190" y="20" anchor="true"/>
\t<connector id="9" name="A press" layer="1" x="10" y="90"/>
\t<Link id="0" layer="16" linesize="1"><connector id="0"/><connector id="1"/></Link>
\t<Link id="1" layer="16" solid="true"><connector id="1"/><connector id="2"/></Link>
\t<Link id="2" layer="16"><connector id="3"/><connector id="4"/></Link>
\t<Link id="3" layer="16"><connector id="2"/></Link>
\t<Link id="4" layer="1"><connector id="9"/></Link>
\t<selected><connector id="0"/></selected>
</linkage2>
"""
KLANN = """<linkage2>
\t<connector anchor="true" x="-90" y="35" id="0"/>
\t<connector x="-84" y="126" id="1"/>
\t<connector anchor="true" x="-100" y="-48" id="2"/>
\t<connector x="-98" y="14" id="3"/>
\t<connector anchor="true" input="true" rpm="-15" x="0" y="0" id="4"/>
\t<connector x="-1.5" y="-37" id="5"/>
\t<connector draw="true" x="-320" y="-125" id="8"/>
\t<connector x="-160" y="73" id="9"/>
\t<Link id="0"><connector id="0"/><connector id="1"/></Link>
\t<Link id="1"><connector id="2"/><connector id="3"/></Link>
\t<Link id="2"><connector id="4"/><connector id="5"/></Link>
\t<Link id="3"><connector id="3"/><connector id="5"/><connector id="9"/></Link>
\t<Link id="5"><connector id="8"/><connector id="9"/><connector id="1"/></Link>
</linkage2>
"""
SLOT = """M[
    J[R, color[Green], P[0.0, 0.0], L[ground, crank]],   # the crank
    J[RP, A[90.0], color[(9, 8, 7)], P[0.0, 40.0], L[lever, crank]],
    J[R, P[0, -100], L[ground, lever]], J[R, P[0, 130], L[lever]],
]
"""
COUPLER_POINT = "M[J[R, P[0, 0], L[ground, L1]], J[R, P[0, 30], L[L1, L2]], J[R, P[80, 90], L[L2, L3]], " + (
    "J[R, P[35, 95], L[L2]], J[R, P[100, 0], L[ground, L3]]]"
)
FORCE = (
    "https://pmks.example/?j=A,0,0,AB,R,t,0,0.1,t,%0AB,0,0.3,AB%7CBC,R,f,0,0.1,f,%0AC,0.8,0.9,BC%7CCD,R,f,0,0.1,f,%0A"
    "D,1,0,CD,R,t,0,0.1,f,%0A&l=AB,2,0.02,0,0.15,A%7CB,,l,0,0,1,0,1,1,0,1%0ABC,5,0.4,0.4,0.6,B%7CC,,l,0,0,1,0,1,1,0,1%0A"
    "CD,4,0.3,0.9,0.45,C%7CD,F1,l,0,0,1,0,1,1,0,1%0A&f=F1,CD,0.8,0.9,0.5,0.9,t,true,-0.0,250%0A&pp=&tp=&s=10,true,false,m"
)


def meets(a, b, near, far):
    """The left one of the points at these distances from two others."""
    way = b - a
    along = (near**2 - far**2 + abs(way) ** 2) / (2 * abs(way))
    return a + way / abs(way) * (along + 1j * math.sqrt(near**2 - along**2))


def test_slider_crank(tmp_path):
    """The place of the rod's end in closed form. What is on the layer of drawings, and a link that has one pin alone,
    are no part of the machine."""
    model = machine(written(tmp_path, SLIDER_CRANK))
    assert {*model.model.described_by.structure.links} == {"L0", "L1", "C2_block"}
    rod = math.hypot(0.117260394, 0.01)
    for q in np.linspace(0.0, 2 * math.pi, 9):
        a = 0.03j * np.exp(1j * q)
        out = model.evaluate({"phi": q})
        assert float(out["L1.C2.x"]) == pytest.approx(
            a.real + math.sqrt(rod**2 - (a.imag - 0.02) ** 2), abs=1e-11
        )
        assert float(out["L1.C2.y"]) == pytest.approx(0.02, abs=1e-11)


def test_klann_leg(tmp_path):
    """The foot, by two dyads in closed form."""
    model = machine(written(tmp_path, KLANN))
    at = {
        0: -90 + 35j,
        1: -84 + 126j,
        2: -100 - 48j,
        3: -98 + 14j,
        5: -1.5 - 37j,
        8: -320 - 125j,
        9: -160 + 73j,
    }

    def turned(new, old, third):
        """A further point of a link, from two points that were elsewhere."""
        return new[0] + (third - old[0]) * (new[1] - new[0]) / (old[1] - old[0])

    for q in np.linspace(0.0, 2 * math.pi, 9):
        p5 = at[5] * np.exp(1j * q)
        p3 = meets(at[2], p5, abs(at[3] - at[2]), abs(at[5] - at[3]))
        p9 = turned((p3, p5), (at[3], at[5]), at[9])
        p1 = meets(p9, at[0], abs(at[9] - at[1]), abs(at[1] - at[0]))
        foot = 1e-3 * turned((p9, p1), (at[9], at[1]), at[8])
        out = model.evaluate({"phi": q})
        assert float(out["L5.C8.x"]) == pytest.approx(foot.real, abs=1e-11)
        assert float(out["L5.C8.y"]) == pytest.approx(foot.imag, abs=1e-11)


def test_sliding_slot():
    """The lever points to the crank pin."""
    model = machine(SLOT)
    for q in np.linspace(0.0, 2 * math.pi, 9):
        a = 0.04j * np.exp(1j * q) + 0.1j
        tip = 0.23 * a / abs(a) - 0.1j
        out = model.evaluate({"phi": q})
        assert float(out["lever.P3.x"]) == pytest.approx(tip.real, abs=1e-11)
        assert float(out["lever.P3.y"]) == pytest.approx(tip.imag, abs=1e-11)


def test_coupler_point():
    """A four-bar in closed form; --scale makes it larger in the ratio of the units."""
    small, large = machine(COUPLER_POINT), machine(COUPLER_POINT, scale="in")
    for q in np.linspace(0.0, 2 * math.pi, 9):
        a, d = 30j * np.exp(1j * q), 100.0
        b = meets(a, d, abs(80 + 60j), abs(-20 + 90j))
        point = a + (35 + 65j) * (b - a) / (80 + 60j)
        for model, scale in ((small, 1e-3), (large, 0.0254)):
            out = model.evaluate({"phi": q})
            assert float(out["L2.P3.x"]) == pytest.approx(scale * point.real, abs=1e-11)
            assert float(out["L2.P3.y"]) == pytest.approx(scale * point.imag, abs=1e-11)


def test_crank_rocker_with_a_force():
    """At rest the torque holds the force by its way, as there is no gravity in the drawing. The crank turns
    clockwise, as it says."""
    model = machine(FORCE)
    for q in np.linspace(0.3, 6.3, 7):

        def end(q):
            return meets(0.3j * np.exp(-1j * q), 1.0, 1.0, abs(-0.2 + 0.9j))

        slope = (-end(q + 2e-4) + 8 * end(q + 1e-4) - 8 * end(q - 1e-4) + end(q - 2e-4)) / 1.2e-3
        out = model.evaluate({"phi": q})
        assert float(out["CD.C.x"]) == pytest.approx(end(q).real, abs=1e-11)
        assert float(out["tau"]) == pytest.approx(250 * slope.real, abs=1e-7)
    assert model.by_name["g"] == 0.0
    assert model.by_name["CD.mass"] == 4.0


def test_an_upright_force_has_no_share_across():
    """A share of 1e-15 N would be warned of as unusual."""
    text = FORCE.replace("0.8,0.9,0.5,0.9,t,true,-0.0,250", "0.8,0.9,0.8,0.2,t,true,0,250")
    across, upward = imported(text).tables["loads"]["F1"]["force"]
    assert across == 0.0 and upward == pytest.approx(-250.0, rel=1e-15)
    assert not imported(text).machine()[1]


def test_a_slider_that_keeps_its_angle():
    """A P joint of Pyslvs is a guide without a block."""
    text = (
        "M[J[R, P[0, 0], L[ground, L1]], J[R, P[0, 30], L[L1, L2]], J[R, P[100, 20], L[L2, L3]], "
        "J[P, A[0], P[140, 5], L[ground, L3]]]"
    )
    model = machine(text)
    assert {*model.model.described_by.structure.links} == {"L1", "L2", "L3"}
    for q in np.linspace(0.0, 2 * math.pi, 9):
        a = 0.03j * np.exp(1j * q)
        x = a.real + math.sqrt(0.1**2 + 0.01**2 - (a.imag - 0.02) ** 2)
        out = model.evaluate({"phi": q})
        assert float(out["L3.P3.x"]) == pytest.approx(x + 0.04, abs=1e-11)
        assert float(out["L3.P3.y"]) == pytest.approx(0.005, abs=1e-11)


def test_a_block_of_pmks():
    """A link of the type P has its pin and its guide in one place: it is the block."""
    text = (
        "j=A,0,0,AB,R,t,0,0.1,t,\nB,0,3,AB|BC,R,f,0,0.1,f,\nC,10,2,BC|CD,R,f,0,0.1,f,\nD,10,2,CD,P,t,0,0.1,f,\n"
        "&l=AB,R,1,1,0,1,A|B,\nBC,R,1,1,5,2,B|C,\nCD,P,7,0,10,2,C|D,\n&f=&s=10,false,true,cm"
    )
    model = machine(text)
    assert {*model.model.described_by.structure.links} == {"AB", "BC", "CD"}
    assert model.by_name["CD.mass"] == pytest.approx(7e-3, rel=1e-15)
    out = model.evaluate({"phi": 1.0})
    a = 0.03j * np.exp(1j)
    assert float(out["CD.C.x"]) == pytest.approx(a.real + math.sqrt(0.0101 - (a.imag - 0.02) ** 2), abs=1e-11)


def test_a_cylinder(tmp_path):
    """An actuator grows from its drawn length by its throw, and so turns the lever."""
    text = """<linkage2>
<connector anchor="true" x="0" y="0" id="0"/><connector x="300" y="200" id="1"/>
<connector anchor="true" x="400" y="-20" id="2"/><connector x="500" y="300" id="3"/>
<Link id="0" actuator="true" throw="60" cpm="15"><connector id="0"/><connector id="1"/></Link>
<Link id="1"><connector id="1"/><connector id="2"/><connector id="3"/></Link>
</linkage2>"""
    model = machine(written(tmp_path, text), density="20 kg/m")
    length = 0.1 * math.sqrt(13)
    assert model.model.described_by.span == pytest.approx((length, length + 0.06), abs=1e-15)
    lever, pivot = abs(-0.1 + 0.22j), 0.4 - 0.02j
    for s in (length, length + 0.033, length + 0.06):
        end = meets(0.0, pivot, s, lever)
        out = model.evaluate({"phi": s})
        assert float(out["L1.C1.x"]) == pytest.approx(end.real, abs=1e-11)
        assert float(out["L1.C1.y"]) == pytest.approx(end.imag, abs=1e-11)
    masses = sum(model.by_name[f"{name}.mass"] for name in ("barrel", "rod"))
    assert masses == pytest.approx(20 * length, rel=1e-14)


def test_links_that_are_one(tmp_path):
    """Two links that share two pins, and a link that is fastened to another one, are one link with both masses."""
    text = KLANN.replace(
        "</linkage2>",
        '<connector x="-110" y="200" id="7"/><Link id="6"><connector id="1"/><connector id="9"/></Link>'
        '<Link id="7" fastenlink="0"><connector id="1"/><connector id="7"/></Link></linkage2>',
    )
    whole = imported(written(tmp_path, text), density="20 kg/m")
    links = whole.tables["links"]
    assert {*links} == {"L0", "L1", "L2", "L3", "L5"}
    assert "C7" in links["L0"]["points"]
    lengths = [abs(6 + 91j), abs(-26 + 74j)]
    assert links["L0"]["mass"] == pytest.approx(0.02 * sum(lengths), rel=1e-14)
    middles = np.array([[3, 45.5], [-7, 128]])
    centroid = lengths @ middles / sum(lengths)
    inertia = sum(
        0.02 * length * (length**2 / 12 + np.sum((middle - centroid) ** 2))
        for length, middle in zip(lengths, middles, strict=True)
    )
    assert links["L0"]["centroid"] == pytest.approx(list(1e-3 * centroid), rel=1e-12)
    assert links["L0"]["inertia"] == pytest.approx(1e-6 * inertia, rel=1e-12)
    assert any("L0, L7 do not move against each other" in remark for remark in whole.remarks)
    machine(written(tmp_path, text))


def test_a_motor_that_swings_by_a_limit(tmp_path):
    """The range of the driver is that of the drawing, about the drawn place and in the direction of the speed."""
    text = KLANN.replace('rpm="-15"', 'rpm="-15" limitangle="90" startoffset="30"')
    model = machine(written(tmp_path, text))
    assert model.model.described_by.span == pytest.approx((-math.pi / 6, math.pi / 3), abs=1e-15)
    foot = complex(*(float(model.evaluate({"phi": 0.0})[f"L5.C8.{axis}"]) for axis in "xy"))
    assert foot == pytest.approx(-0.32 - 0.125j, abs=1e-12)
    turned = complex(*(float(model.evaluate({"phi": 1.0})[f"L2.C5.{axis}"]) for axis in "xy"))
    assert turned == pytest.approx((-1.5e-3 - 0.037j) * np.exp(1j), abs=1e-12)
    clockwise = machine(written(tmp_path, text.replace('rpm="-15"', 'rpm="15"')))
    turned = complex(*(float(clockwise.evaluate({"phi": 1.0})[f"L2.C5.{axis}"]) for axis in "xy"))
    assert turned == pytest.approx((-1.5e-3 - 0.037j) * np.exp(-1j), abs=1e-12)
    # one that swings beside one that turns round is an input
    five_bar = FIVE_BAR.replace('id="4" anchor="true"', 'id="4" anchor="true" limitangle="20"')
    tables = imported(written(tmp_path, five_bar)).tables
    assert tables["driver"]["link"] == "L0" and "phi" not in tables["drivers"]["motor_C4"]
    assert tables["drivers"]["motor_C4"]["range"] == pytest.approx([0.0, math.radians(20)])


@pytest.mark.parametrize(
    "change",
    [
        ("utf-8", ' y="0" id="4"', 'y="0"id="4"'),
        ("utf-8", 'id="8"', 'id="8" name="feet & toes &amp; heel"'),
        ("cp1252", 'id="8"', 'id="8" name="Fu\xdf & Zeh"'),
    ],
    ids=range(3),
)
def test_what_the_program_reads_and_no_reader_of_xml(change, tmp_path):
    encoding, old, new = change
    assert old in KLANN
    file = tmp_path / "leg.linkage2"
    file.write_bytes(KLANN.replace(old, new).encode(encoding))
    assert imported(str(file)).tables == imported(written(tmp_path, KLANN)).tables


def test_what_only_draws_is_left_out_and_named(tmp_path):
    """Connectors on the layer of drawings, also if they are fastened to a link, and links of one pin."""
    text = KLANN.replace(
        '<connector id="8"/>', '<connector id="8"/><fastenconnector id="70"/><fastenconnector id="71"/>'
    ).replace(
        "</linkage2>",
        '<connector id="70" layer="1" x="5" y="6"/><Link id="9" layer="1"><connector id="70"/></Link>'
        '<Link id="10"><connector id="2"/></Link></linkage2>',
    )
    source = imported(written(tmp_path, text))
    assert source.tables == imported(written(tmp_path, KLANN)).tables
    assert "2 connectors and links only draw or measure: left out" in source.remarks
    assert "the link L10 has fewer than two pins, and is left out" in source.remarks
    assert any('--scale "0.2645833 mm"' in remark for remark in source.remarks)


@pytest.mark.parametrize("radius", ["150.5", "-150.5"])
def test_a_curved_slot_is_refused_on_either_side(radius, tmp_path):
    text = SLIDER_CRANK.replace('slider="true"', f'slider="true" slideradius="{radius}"')
    assert "connector 2: slides along an arc; only a straight slot" in refusal(written(tmp_path, text))


def test_two_cylinders_have_names_of_their_own(tmp_path):
    """The one on the ground is the first driver, also if it stands last in the file; each is an input. The other one
    holds two bars of an arm at their angle."""
    text = """<linkage2>
<connector anchor="true" x="0" y="0" id="0"/><connector x="300" y="100" id="1"/><connector x="400" y="-60" id="2"/>
<connector anchor="true" x="200" y="-300" id="3"/><connector x="120" y="140" id="4"/>
<Link id="0"><connector id="0"/><connector id="1"/><connector id="4"/></Link>
<Link id="1"><connector id="1"/><connector id="2"/></Link>
<Link id="2" actuator="true" throw="20" cpm="15"><connector id="4"/><connector id="2"/></Link>
<Link id="3" actuator="true" throw="50" cpm="-15"><connector id="3"/><connector id="1"/></Link>
</linkage2>"""
    source = imported(written(tmp_path, text))
    assert source.tables["driver"]["joint"] == "cylinder"
    (name,) = source.tables["drivers"]
    assert name == source.tables["drivers"][name]["joint"] == "cylinder_1"
    assert "Link 2 is the cylinder_1 of barrel_1 and rod_1" in source.remarks
    model = Machine(source.machine()[0])
    first, second = math.hypot(0.1, 0.4), math.hypot(0.28, 0.2)
    out = model.evaluate({"phi": first - 0.02, "cylinder_1_driver.phi": second + 0.015})
    at = {pin: complex(*(float(out[f"{link}.C{pin}.{axis}"]) for axis in "xy"))
          for link, pin in (("L0", 1), ("L0", 4), ("L1", 2))}  # fmt: skip
    assert abs(at[1] - (0.2 - 0.3j)) == pytest.approx(first - 0.02, abs=1e-12)
    assert abs(at[2] - at[4]) == pytest.approx(second + 0.015, abs=1e-12)
    assert abs(at[2] - at[1]) == pytest.approx(math.hypot(0.1, 0.16), abs=1e-12)


@pytest.mark.parametrize("ends", ["03", "30"])
def test_a_cylinder_along_a_slot_drives_its_guide(ends, tmp_path):
    """It stands on the ground and pulls a block, which pulls a rod; the place is the way from the first limit."""
    first, second = ends
    text = f"""<linkage2>
<connector anchor="true" x="500" y="50" id="0"/><connector x="200" y="50" id="1" slider="true">
<slidelimit id="{first}"/><slidelimit id="{second}"/></connector><connector x="350" y="250" id="2"/>
<connector anchor="true" x="0" y="50" id="3"/><connector anchor="true" x="520" y="60" id="4"/>
<Link id="0" actuator="true" throw="40" cpm="-5"><connector id="0"/><connector id="1"/></Link>
<Link id="1"><connector id="0"/><connector id="3"/></Link><Link id="2"><connector id="1"/><connector id="2"/></Link>
<Link id="3"><connector id="2"/><connector id="4"/></Link></linkage2>"""
    source = imported(written(tmp_path, text))
    assert "Link 0 drives C1_guide, and has no mass" in source.remarks
    model = Machine(source.machine()[0])
    start, pulled = (0.3, 0.26) if first == "0" else (0.2, 0.24)
    assert model.model.described_by.span == pytest.approx(sorted([start, pulled]), abs=1e-15)
    out = model.evaluate({"phi": pulled})
    assert float(out["L2.C1.x"]) == pytest.approx(0.24, abs=1e-12)
    pin = meets(0.24 + 0.05j, 0.52 + 0.06j, 0.25, abs(-0.17 + 0.19j))
    assert complex(float(out["L3.C2.x"]), float(out["L3.C2.y"])) == pytest.approx(pin, abs=1e-11)


def test_an_address_whose_block_has_no_numbers():
    """An older address has Null for the mass of a block, and in place of an angle. Its speed is told, as is friction
    that is left out."""
    address = "j=a,0,0,ab,R,t,Null,t\nb,0,3,ab|bc,R,f,Null,f\nc,10,2,bc|cd,R,f,Null,f\nd,10,2,cd,P,t,Null,f\n"
    address += "&l=ab,R,1,1,0,1,a|b,,line\nbc,R,1,1,5,2,b|c,,line\ncd,P,Null,Null,Null,Null,c|d,,Null\n"
    address += "&f=&s=20,true,true,cm"
    source = imported(address)
    out = Machine(source.machine()[0]).evaluate({"phi": 1.0})
    crank = 0.03j * np.exp(-1j)
    assert float(out["cd.c.x"]) == pytest.approx(
        crank.real + math.sqrt(0.0101 - (crank.imag - 0.02) ** 2), abs=1e-11
    )
    assert any("clockwise at 20 rev/min" in remark for remark in source.remarks)
    assert not any("friction" in remark for remark in source.remarks)
    assert any("the friction of the drawing is left out" in remark for remark in imported(FORCE).remarks)


@pytest.mark.parametrize(
    "comment", ["#[ of\n several # lines #] and more\n", "# one\n#[ two\n lines #]\n\n", "  # M[ ]\n"]
)
def test_a_comment_before_an_expression(comment, tmp_path):
    source = written(tmp_path, comment + COUPLER_POINT, "drawing.txt")
    assert imported(source).tables == imported(COUPLER_POINT).tables


# what cannot be carried over

FIVE_BAR = (
    '<linkage2><connector x="0" y="0" id="0" anchor="true" input="true"/><connector x="200" y="0" id="1"/>'
    '<connector x="600" y="900" id="2"/><connector x="1400" y="0" id="3"/>'
    '<connector x="1200" y="0" id="4" anchor="true" input="true"/>'
    '<Link id="0"><connector id="0"/><connector id="1"/></Link>'
    '<Link id="1"><connector id="1"/><connector id="2"/></Link>'
    '<Link id="2"><connector id="2"/><connector id="3"/></Link>'
    '<Link id="3"><connector id="3"/><connector id="4"/></Link></linkage2>'
)
# the left crank turns, a cylinder on the ground moves the right one
CYLINDER_BAR = FIVE_BAR.replace('id="4" anchor="true" input="true"', 'id="4" anchor="true"').replace(
    "</linkage2>",
    '<connector x="1800" y="600" id="5" anchor="true"/>'
    '<Link id="5" actuator="true" throw="50"><connector id="5"/><connector id="3"/></Link></linkage2>',
)


def test_two_inputs_are_two_drivers(tmp_path):
    """Motors turn in step by their speeds, the slowest one first, clockwise above 0; a cylinder is an input of its
    own."""
    five_bar = FIVE_BAR.replace('id="0" anchor="true"', 'id="0" anchor="true" rpm="-30"').replace(
        'id="4" anchor="true"', 'id="4" anchor="true" rpm="15"'
    )
    source = imported(written(tmp_path, five_bar), density="20 kg/m")
    clockwise = {"positive": "clockwise"}
    assert source.tables["driver"] == {"link": "L3", **clockwise}
    follower = {"link": "L0", **clockwise, "phi": "-2.0 * phi", "by": "motor"}
    assert source.tables["drivers"] == {"motor_C0": follower}
    assert any("connector 0 turns -2 times as fast as connector 4" in remark for remark in source.remarks)
    out = Machine(source.machine()[0]).evaluate({"phi": 0.4, "w": 2.0})
    assert out["motor_C0.phi"] == pytest.approx(-0.8) and out["motor_C0.w"] == pytest.approx(-4.0)
    assert out["L0.w"] == pytest.approx(4.0) and out["L3.w"] == pytest.approx(-2.0)
    cylinder = imported(written(tmp_path, CYLINDER_BAR), density="20 kg/m").tables
    (name,) = cylinder["drivers"]
    assert cylinder["drivers"][name]["joint"] == name and cylinder["drivers"][name]["range"][0] > 0.0
    assert {f"{name}_driver.{key}" for key in ("phi", "w", "a")} <= {
        *machine(written(tmp_path, CYLINDER_BAR), density="20 kg/m").model.input_layout.names
    }
    uneven = five_bar.replace('rpm="-30"', 'rpm="-20"')
    said = refusal(written(tmp_path, uneven))
    assert "moves by -1.33333 turns in a turn of the first driver" in said
    # the slower one is the first already
    assert "turn the faster one a whole number of times as fast, or let [driver] swing" in said
    address = "j=A,0,0,l,R,t,0,t\nB,0.3,0,l|m,R,f,0,f\nC,0.8,0.9,m|n,R,f,0,f\nD,1.5,0,n|o,R,f,0,f\n"
    address += (
        "E,1.2,0,o,R,t,0,t&l=l,1,1,0,0,A|B\nm,1,1,0,0,B|C\nn,1,1,0,0,C|D\no,1,1,0,0,D|E&f=&s=10,true,true,m"
    )
    assert imported(address).tables["drivers"]["motor_E"]["phi"] == "1.0 * phi"


WHEELS = """<linkage2>
<connector id="0" x="0" y="0" anchor="true" input="true" rpm="30"/>
<connector id="1" x="0" y="100"/>
<connector id="2" x="60" y="100"/>
<connector id="3" x="60" y="130"/>
<Link id="0"><connector id="0"/><connector id="1"/><connector id="2"/></Link>
<Link id="1" gear="true"><connector id="1"/></Link>
<Link id="2" gear="true"><connector id="2"/></Link>
<Link id="3" fastenlink="2"><connector id="2"/><connector id="3"/></Link>
<Link id="4" gear="true" fastenconnector="0"><connector id="0"/></Link>
<ratios>
<ratio type="chain" sizeassize="true"><link id="4" size="20"/><link id="1" size="20"/></ratio>
<ratio type="gears"><link id="2" size="1"/><link id="1" size="3"/></ratio>
</ratios></linkage2>"""


@pytest.mark.parametrize("has_radii", [True, False])
def test_gears_and_a_chain(has_radii, tmp_path):
    """A chain of 1:1 from a fixed wheel: the first wheel on the arm does not turn, so that the second one turns with
    the arm, and three turns more."""
    text = WHEELS if has_radii else WHEELS.replace('sizeassize="true"', 'sizeassize="false"')
    unit = machine(written(tmp_path, text), density="10 kg/m")
    diameter = 0.04 if has_radii else 0.05
    chain = unit.model.described_by.structure.joints["chain"].table
    assert chain["diameters"] == pytest.approx([diameter, diameter], rel=1e-12)
    q = np.linspace(0.0, 6.0, 7)
    out = unit.outputs(q, 2.0)
    assert out.L1.angle == pytest.approx(np.zeros(7), abs=1e-12)
    assert out.L2.angle == pytest.approx(-4.0 * q, abs=1e-11)  # the drawn motor turns clockwise
    with pytest.raises(
        InputError, match="are wheels of which one has not one pin, its centre; fasten the others"
    ):
        imported(written(tmp_path, text.replace('<link id="1" size="3"/>', '<link id="0" size="3"/>')))


def test_a_linkage_that_lacks_an_input_is_refused():
    five_bar = COUPLER_POINT.replace("L[L2, L3]", "L[L2, L4]").replace(
        "P[35, 95], L[L2]", "P[90, 50], L[L4, L3]"
    )
    assert "too many degrees of freedom: 2" in refusal(five_bar)


def test_all_faults_come_at_once(tmp_path):
    text = KLANN.replace('x="-84"', 'x="-8 4"').replace(
        "</linkage2>",
        '<connector x="1" y="1e99" id="1"/><connector x="1" y="nan" id="30" slider="true" slideradius="4">'
        '<slidelimit id="2"/><slidelimit id="3"/></connector><Link id="8"><connector id="77"/></Link>'
        '<Link id="9" fastenlink="55"><connector id="30"/><connector id="5"/></Link>'
        '<ratios><ratio type="gears"><link id="0" size="2"/><link id="88" size="3"/></ratio></ratios></linkage2>',
    )
    lines = refusal(written(tmp_path, text)).splitlines()
    beginnings = (
        'connector 1: has "-8 4" in place of a number', "connector 1: stands there twice",
        'connector 30: has "nan" in place of a number', "Link 8: names connector 77, which is not in the ",
        "Link 9: is fastened, but not to a link of the file", "connector 30: slides along an arc",
        "Link 0 and Link 88: are wheels of a gear or a chain; they must be two links of the file",
    )  # fmt: skip
    assert len(lines) == len(beginnings)
    for line, begin in zip(lines, beginnings, strict=True):
        assert line.startswith(f"{tmp_path / 'drawing.linkage2'}: {begin}")


@pytest.mark.parametrize(
    "change, message",
    [
        (("D,1,0,CD,R,t", "D,1,0,CD,P,f"), 'joint "D": must stand there once, and must be R, or P in the ground'),
        (("s=10,true,false,m", "s=10,true,false,ell"), 'settings: the unit of length is "ell"; set it to cm or m'),
        (("CD,4,0.3", "CD,-4,0.3"), 'link "CD": must have a mass and an inertia >= 0'),
        (("F1,CD,0.8", "F1,EF,0.8"), 'force "F1": is on "EF", which is no link of the address'),
        (("0.5,0.9,t,true,-0.0,250", "0.5"), 'force "F1": has 5 fields; must have id, link, x and y'),
        (("A,0,0,AB,R,t,0,0.1,t", "A,0,0,AB,R,f,0,0.1,t"), "the input turns AB; it must turn one link"),
    ],
)  # fmt: skip
def test_an_address_that_is_wrong(change, message):
    assert message in refusal(FORCE.replace(*change))


@pytest.mark.parametrize(
    "text, message",
    [
        ("M[J[R, P[0, 0], L[ground, L1]], J[R, P[0, 1", "must be M[J[...], J[...], ...]; it is wrong at"),
        ("M[J[R, P[0, 0], L[ground, L1]], K[R]]", 'it is wrong at "K[R]"'),
        ("M[J[P, P[0, 0], L[ground, L1]]]", "joint 0: must be J[R, P[x, y], L[...]]"),
        ("M[J[RP, A[0], P[0, 0], L[L1]]]", "joint 0: slides, and has fewer than two links"),
        ("M[J[R, P[0, x], L[ground, L1]]]", 'joint 0: has "x" in place of a number'),
        ("M[]", "Pyslvs: the input turns no link; it must turn one link"),
        ("https://pmks.example/?2P.c,1T", "is an address without joints"),
        ("j=&l=&f=", "has no joints and links; must be the plain address"),
    ],
)
def test_a_text_that_is_wrong(text, message):
    assert message in refusal(text)


@pytest.mark.parametrize(
    "text, message",
    [
        (KLANN[:300], "is no XML that can be read"),
        ("<svg/>", 'begins with "svg"; a file of Linkage begins with <linkage2>'),
        ("links: no XML", "is no XML that can be read"),
        ('<!DOCTYPE linkage2 [<!ENTITY a "aaaaaaaa">]><linkage2>&a;</linkage2>', "has a document type"),
        ("<linkage2/>", "Linkage: the input turns no link"),
        ("<linkage2>" + "".join(f'<connector id="{k}" x="0" y="0"/>' for k in range(20000)) + "</linkage2>",
         "more than 100 pins"),
        ("<linkage2>" + '<Link id="0"/>' * 60000 + "</linkage2>", "more than 100"),
        ("<linkage2>" + "<a>" * 100000 + "</a>" * 100000 + "</linkage2>", ""),
        ("<linkage2>" + " " * 2**20 + "</linkage2>", "has more than 1 MiB"),
    ],
    ids=range(9),
)  # fmt: skip
def test_a_file_that_is_broken_or_hostile_is_refused_in_seconds(text, message, tmp_path):
    begin = time.perf_counter()
    assert message in refusal(written(tmp_path, text))
    assert time.perf_counter() - begin < 5.0


def test_many_links_on_two_pins_are_one_link_in_seconds():
    names = ", ".join(f"a{k}" for k in range(95))
    begin = time.perf_counter()
    text = f"M[J[R, P[0, 0], L[ground, c]], J[R, P[1, 0], L[c, {names}]], J[R, P[2, 0], L[{names}]]]"
    assert {*imported(text).tables["links"]} == {"c", "a0"}
    assert time.perf_counter() - begin < 5.0


def test_a_long_expression_or_address_is_refused_in_seconds(tmp_path):
    begin = time.perf_counter()
    for text in ("M[" + "J[R, P[0, 0], L[a]]," * 40000 + "]", "M[" + "#[" * 400000, "M[" + "J[R," + "[" * 900000,
                 "j=" + "A,0,0,AB,R,t,0,0.1,t,\n" * 40000 + "&l=AB,1,1,0,0,A"):  # fmt: skip
        assert refusal(written(tmp_path, text, "drawing.txt"))
    assert time.perf_counter() - begin < 10.0


# the command


def test_the_command_takes_a_drawing_at_once_or_writes_it(tmp_path):
    """Both give the same numbers to the last bit; what has been added to the drawing is said in either."""
    written(tmp_path, KLANN, "leg.linkage2")
    done = chainunit("linkage", "leg.linkage2", "--to", "leg.toml", "--density", "20 kg/m", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    said = "links without a mass in the drawing have 20 kg/m between their farthest pins"
    assert said in done.stdout and f"# {said}" in (tmp_path / "leg.toml").read_text("utf-8")
    tables = imported(str(tmp_path / "leg.linkage2"), density="20 kg/m")
    assert tomllib.loads((tmp_path / "leg.toml").read_text("utf-8")) == tables.tables
    places = np.linspace(0.0, 2 * math.pi, 13)
    by_file = Machine(read_linkage(tmp_path / "leg.toml")).outputs(places, 5.0)
    at_once = Machine(tables.machine()[0]).outputs(places, 5.0)
    for name in ("tau", "J"):
        assert np.array_equal(getattr(by_file, name), getattr(at_once, name))
    assert np.array_equal(by_file.L5.C8.y, at_once.L5.C8.y)
    assert np.max(np.abs(by_file.tau)) > 0.1


@pytest.mark.second
def test_the_command_reports_a_drawing(tmp_path):
    done = chainunit("linkage", COUPLER_POINT, "-o", "out", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "crank" not in done.stdout and "L1 + RRR dyad (L2, L3)" in done.stdout
    for sentence in ("Read from a drawing of Pyslvs, with lengths in mm.", "L1, L2, L3 without mass; --density gives",
                     "The source names no input: L1 is the driver."):  # fmt: skip
        assert sentence in done.stdout


def test_a_machine_that_is_refused_can_be_written_and_mended(tmp_path):
    """The range that the refusal names goes into the file."""
    text = COUPLER_POINT.replace("P[0, 30]", "P[0, 90]")
    done = chainunit("linkage", text, cwd=tmp_path)
    assert done.returncode == 2
    assert "write it as a linkage file: --to machine.toml" in done.stderr and "write range = " in done.stderr
    done = chainunit("linkage", text, "--to", "machine.toml", cwd=tmp_path)
    assert done.returncode == 2 and "machine.toml:" in done.stderr
    file = tmp_path / "machine.toml"
    file.write_text(
        file.read_text("utf-8").replace('link = "L1"', 'link = "L1"\nrange = ["-20 deg", "10 deg"]'), "utf-8"
    )
    assert Machine(read_linkage(file)).evaluate({"phi": 0.1})["tau"] == 0.0


@pytest.mark.parametrize(
    "arguments, message",
    [
        (("leg.linkage2", "--to", "leg.linkage2"), "--to leg.linkage2: writes a drawing of another program"),
        (("machine.toml", "--to", "other.toml"), "--to other.toml: writes a drawing of another program"),
        (("machine.toml", "--density", "20 kg/m"), "machine.toml is a linkage file"),
        (("leg.linkage2", "--density", "5 kg"), '--density "5 kg": kg is a mass; must be'),
        (("leg.linkage2", "--scale", "kg"), "kg is a mass; must be a length"),
        (("no.linkage2",), "no.linkage2: cannot be read"),
    ],
)
def test_an_option_that_is_wrong(arguments, message, tmp_path):
    written(tmp_path, KLANN, "leg.linkage2")
    written(tmp_path, "[ground]\n", "machine.toml")
    done = chainunit("linkage", *arguments, cwd=tmp_path)
    assert done.returncode == 2 and message in done.stderr


@pytest.mark.parametrize("source", ["https://example.org/pmks?mech=1", "file"])
def test_an_address_without_joints_is_refused(source, tmp_path):
    if source == "file":
        source = str(tmp_path / "a.txt")
        Path(source).write_text("https://example.org/pmks?mech=1", "utf-8")
    with pytest.raises(
        InputError, match=r"is an address without joints; the address of a machine in PMKS\+ has \?j="
    ):
        imported(source)
