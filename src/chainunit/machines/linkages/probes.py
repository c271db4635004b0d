"""Outputs of a linkage from its mechanism at one state: reactions of guides, motion of points, axes of links."""

from __future__ import annotations

from typing import Any

from ...groups.group import GuideForce
from ...mechanism.machine import Mechanism
from ...planar import Motion, Vec2
from .declarations import GuideReaction, PointMotion
from .parts import LinkageParts, LinkFrame
from .structure import JointEntry


def own_axis(u: Vec2, frame: LinkFrame) -> Vec2:
    """The x axis of a link's description, from the direction of its frame in the group."""
    e = frame.axis
    return Vec2(u.x * e.x + u.y * e.y, u.y * e.x - u.x * e.y)


def point_motion(k: Motion, w: Any, a: Any) -> PointMotion:
    """The motion of a point at speed `w` and acceleration `a` of the driver."""
    w2 = w * w
    return PointMotion(
        x=k.p.x,
        y=k.p.y,
        vx=k.p1.x * w,
        vy=k.p1.y * w,
        ax=k.p1.x * a + k.p2.x * w2,
        ay=k.p1.y * a + k.p2.y * w2,
    )


def guide_reaction(
    m: Mechanism,
    joint: JointEntry,
    key: tuple[str, str],
    sign: float,
    reaction: Vec2,
    parts: LinkageParts,
    w: Any,
    a: Any,
) -> GuideReaction:
    """The reaction of a sliding joint on the link that is named first, about its point, and the motion in it."""
    assert isinstance(reaction, GuideForce)
    slide, block = m.slides[key], m.pins[key[0]]
    # the line of the driver has the direction in which the driver moves
    along = sign if joint.name == parts.structure.driver.joint else 1.0
    d = slide.d * along
    n = d.turned()
    moment = reaction.moment - (block.p - m.links[key[1]].pin.p).cross(reaction)
    start = m.pins[parts.pin_on(*joint.by)]
    s1, s2 = slide.s1 * sign * along, slide.s2 * sign * along
    return GuideReaction(
        fx=reaction.x * sign,
        fy=reaction.y * sign,
        normal=reaction.dot(n) * sign,
        moment=moment * sign,
        s=(block.p - start.p).dot(d),
        v=s1 * w,
        a=s1 * a + s2 * (w * w),
    )
