"""CalculiX input for the section: mesh, sidewall springs, inflation, road.

Elements are CPE8R whose material has no Poisson coupling across the tire, so their in-plane law is
that of plane stress exactly and their width stays b. Sidewall springs sit between the middle line
and the rim, which is fixed: they take the radial and the tangential part of the displacement, in
directions that do not turn, as the ring's springs do.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from mesh import Ints, Mesh
from section import Layer, Section, Target


@dataclass(frozen=True)
class Contact:
    """Penalty contact with Coulomb friction, stiffnesses per area of road."""

    friction: float
    normal: float = 5.0e10
    """Pressure per overclosure, [Pa/m]; the tread has about 5e8."""
    stick: float = 1.0e10
    """Shear per elastic slip where the tread sticks, [Pa/m]; the tread has about 2e8."""


@dataclass(frozen=True)
class Touch:
    """How contact is made, and how far a load may grow in one increment."""

    gap: float = 0.5e-3
    """Between tire and road before inflation, [m]: more than the tire grows."""
    travel: float = 3.0e-3
    load: float = 200.0
    increment: float = 1.5e-3
    load_increment: float = 300.0


def contact_deck(
    section: Section, mesh: Mesh, contact: Contact, touch: Touch, loads: Sequence[float]
) -> str:
    """Inflate, push the road up by a travel, let it go under a load, then raise the load.

    The road moves as one rigid body. Its load stands from the second step on, but is felt only
    after the prescribed travel is given up, when contact holds the road already.
    """
    road = int(mesh.ids.max()) + 1
    lines = [*_body(section, mesh), *_road(mesh, section, road, contact, touch.gap)]
    lines += ["*BOUNDARY", "ROAD,1,1,0.", f"{road},2,2,0."]
    lines += _step(_inflation(section), first=0.25, most=1.0)
    push = [
        "*BOUNDARY",
        f"{road},2,2,{touch.travel:.9e}",
        "*CLOAD",
        f"{road},2,{touch.load / 2:.9e}",
    ]
    share = min(1.0, touch.increment / touch.travel)
    lines += _step(push, first=share / 4.0, most=share)
    free = ["*BOUNDARY,OP=NEW", "ENDS,1,1,0.", "RIM,3,3,0.", "ROAD,1,1,0."]
    before = touch.load
    for load in loads:
        share = min(1.0, touch.load_increment / abs(load - before))
        lines += _step([*free, "*CLOAD", f"{road},2,{load / 2.0:.9e}"], first=share / 4, most=share)
        before, free = load, []
    return "\n".join(lines) + "\n"


def harmonic_deck(
    section: Section, mesh: Mesh, orders: Sequence[int], load: float, *, inflated: bool
) -> str:
    """Load the middle line by load cos(n phi) [N/m], outward, one step for each order n."""
    lines = _body(section, mesh)
    pressure = _inflation(section) if inflated else ["*CLOAD", f"{middle_line(mesh)[0][0]},1,0."]
    lines += _step(pressure, first=0.25, most=1.0)
    nodes, phi, weight = middle_line(mesh)
    for n in orders:
        force = load * np.cos(n * phi) * weight
        push = [f"{a},1,{f * np.sin(p):.9e}" for a, f, p in zip(nodes, force, phi, strict=True)]
        push += [f"{a},2,{-f * np.cos(p):.9e}" for a, f, p in zip(nodes, force, phi, strict=True)]
        lines += _step(["*CLOAD,OP=NEW", *push], first=1.0, most=1.0)
    return "\n".join(lines) + "\n"


def middle_line(mesh: Mesh) -> tuple[Ints, np.ndarray, np.ndarray]:
    """Nodes of the middle line between elements, their angles and the length [m] of each."""
    row = int(np.argmin(np.abs(mesh.y)))
    phi = mesh.phi[::2]
    weight = np.gradient(phi) * mesh.radius
    weight[[0, -1]] = np.diff(phi)[[0, -1]] / 2.0 * mesh.radius
    weight[1:-1] = (phi[2:] - phi[:-2]) / 2.0 * mesh.radius
    return mesh.ids[::2, row], phi, weight


def _body(section: Section, mesh: Mesh) -> list[str]:
    target = section.target
    lines = ["*NODE, NSET=TIRE"]
    points = mesh.points()
    lines += [f"{k + 1},{x:.12e},{y:.12e},0." for k, (x, y) in enumerate(points)]
    lines += ["*ELEMENT, TYPE=CPE8R, ELSET=TIRE"]
    flat = mesh.elements.reshape(-1, 8)
    lines += [f"{k + 1}," + ",".join(map(str, e)) for k, e in enumerate(flat)]
    for row in range(mesh.elements.shape[1]):
        lines += [f"*ELSET, ELSET=ROW{row}", *_rows(mesh.element_ids(row))]
    lines += ["*ORIENTATION, NAME=RADIAL, SYSTEM=CYLINDRICAL", "0.,0.,0.,0.,0.,1."]
    for k, layer in enumerate(section.layers):
        lines += _material(f"M{k}", layer)
    for row, k in enumerate(mesh.layer_of_row):
        lines += [
            f"*SOLID SECTION, ELSET=ROW{row}, MATERIAL=M{k}, ORIENTATION=RADIAL",
            f"{target.width:.9e}",
        ]
    nodes, phi, weight = middle_line(mesh)
    springs = _springs(target, nodes, phi, weight, start=int(mesh.ids.max()) + 100)
    ends = mesh.ids[[0, -1]]
    lines += [*springs, "*NSET, NSET=ENDS", *_rows(ends[ends > 0])]
    return [*lines, "*BOUNDARY", "ENDS,1,1,0.", "RIM,3,3,0."]


def _material(name: str, layer: Layer) -> list[str]:
    """In cylindrical axes 1 radial, 2 along the circumference, 3 across; no coupling with 3."""
    e1, e2 = layer.modulus, layer.along * layer.modulus
    numbers = [e1, e2, e1, layer.poisson, 0.0, 0.0, layer.shear, layer.shear]
    head = ",".join(f"{x:.9e}" for x in numbers)
    return [
        f"*MATERIAL, NAME={name}",
        "*ELASTIC, TYPE=ENGINEERING CONSTANTS",
        head,
        f"{layer.shear:.9e}",
    ]


def _springs(
    target: Target, nodes: Ints, phi: np.ndarray, weight: np.ndarray, start: int
) -> Iterator[str]:
    """Scalar nodes that carry (radial, tangential) displacement, tied to the middle line."""
    ku, kv = target.radial_stiffness, target.tangential_stiffness
    ids = start + np.arange(nodes.size)
    yield "*NODE, NSET=RIM"
    yield from (f"{i},0.,0.,0." for i in ids)
    yield "*EQUATION"
    for a, i, p in zip(nodes, ids, phi, strict=True):
        s, c = np.sin(p), np.cos(p)
        for dof, (x, y) in enumerate(((s, -c), (c, s)), start=1):
            yield "3"
            yield f"{i},{dof},1.,{a},1,{-x:.12e},{a},2,{-y:.12e}"
    for dof, k in ((1, ku), (2, kv)):
        for i, w in zip(ids, weight, strict=True):
            yield f"*ELEMENT, TYPE=SPRING1, ELSET=S{dof}_{i}"
            yield f"{i + dof * ids.size},{i}"
            yield f"*SPRING, ELSET=S{dof}_{i}"
            yield f"{dof}"
            yield f"{k * w:.12e}"


def _road(mesh: Mesh, section: Section, road: int, contact: Contact, gap: float) -> list[str]:
    top = -(section.target.ring_radius + section.target.outer_offset) - gap
    corners = [(-0.03, top - 0.03), (0.22, top - 0.03), (0.22, top), (-0.03, top)]
    inside = np.flatnonzero(mesh.phi[2::2] < 0.75)
    outer = mesh.element_ids(mesh.elements.shape[1] - 1)[inside]
    lines = ["*NODE, NSET=ROAD"]
    lines += [f"{road + k},{x:.9e},{y:.9e},0." for k, (x, y) in enumerate(corners)]
    block = int(mesh.elements.shape[0] * mesh.elements.shape[1]) + 1
    lines += ["*ELEMENT, TYPE=CPE4, ELSET=ROAD"]
    lines += [f"{block},{road},{road + 1},{road + 2},{road + 3}"]
    lines += ["*EQUATION"]
    lines += [x for k in (1, 2, 3) for x in ("2", f"{road + k},2,1.,{road},2,-1.")]
    lines += ["*MATERIAL, NAME=ROAD", "*ELASTIC", "2.E11,0."]
    lines += ["*SOLID SECTION, ELSET=ROAD, MATERIAL=ROAD", f"{section.target.width:.9e}"]
    lines += ["*SURFACE, NAME=SROAD, TYPE=ELEMENT", f"{block},S3"]
    lines += ["*SURFACE, NAME=STREAD, TYPE=ELEMENT", *(f"{e},S1" for e in outer)]
    lines += ["*ELSET, ELSET=OUTER", *_rows(outer)]
    lines += ["*SURFACE INTERACTION, NAME=TOUCH"]
    lines += ["*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR", f"{contact.normal:.6e}"]
    if contact.friction:
        lines += ["*FRICTION", f"{contact.friction},{contact.stick:.6e}"]
    lines += ["*CONTACT PAIR, INTERACTION=TOUCH, TYPE=SURFACE TO SURFACE", "STREAD,SROAD"]
    return lines


def _inflation(section: Section) -> list[str]:
    return ["*DLOAD", f"ROW0,P3,{section.target.pressure:.9e}"]


def _step(load: Sequence[str], first: float, most: float, road: bool = True) -> list[str]:
    printed = ["*NODE PRINT, NSET=TIRE, FREQUENCY=1000", "U"]
    printed += ["*EL PRINT, ELSET=TIRE, FREQUENCY=1000", "E,S"]
    if road:
        printed += ["*NODE PRINT, NSET=ROAD, TOTALS=ONLY, FREQUENCY=1000", "RF"]
        printed += ["*CONTACT FILE, FREQUENCY=1000", "CDIS,CSTR"]
    return [
        "*STEP, NLGEOM, INC=1000",
        "*STATIC",
        f"{first:.6e},1.,1.E-7,{most:.6e}",
        *load,
        *printed,
        "*END STEP",
    ]


def _rows(ids: Iterable[int], per_line: int = 12) -> list[str]:
    values = [str(int(i)) for i in ids]
    return [",".join(values[k : k + per_line]) for k in range(0, len(values), per_line)]
