"""What is computed: which tires, which roads, which meshes."""

from dataclasses import dataclass, field, replace

from deck import Contact, Touch, contact_deck
from mesh import Fineness, Mesh, mesh
from section import Section, Target, section

LOADS = (1500.0, 3000.0, 4500.0, 6000.0, 7500.0)
SLACK_LOADS = (250.0, 500.0, 1000.0, 1500.0, 2000.0)
"""Loads of a tire without inflation pressure, [N]."""
TARGETS = {
    "solid": Target(),
    "blocks": Target(along=0.02),
    "stretchy": Target(core_thickness=0.002),
    "slack": Target(along=0.02, pressure=0.0, tangential_stiffness=0.0),
}
"""solid: tread of one piece of rubber; blocks: a tread that carries no force along the
circumference, as springs do; stretchy: solid on a belt with a quarter of the tensile stiffness;
slack: blocks on a belt without inflation and tangential springs, the tire of the oldest model."""
COARSE = Fineness(contact_length=4.0e-3, free_length=12.0e-3, tread=2)
NORMAL = Fineness()
FINE = Fineness(contact_length=1.0e-3, free_length=3.0e-3, tread=8)


@dataclass(frozen=True)
class Case:
    """One job."""

    tire: str
    friction: float
    fineness: Fineness = NORMAL
    label: str = ""
    """What sets it apart from the stored case of the same tire and friction."""
    contact: Contact = field(default_factory=lambda: Contact(0.0))
    touch: Touch = field(default_factory=Touch)
    loads: tuple[float, ...] = LOADS

    @property
    def name(self) -> str:
        """Name of the job's files."""
        return f"{self.tire}_mu{100 * self.friction:03.0f}" + (self.label and f"_{self.label}")

    @property
    def section(self) -> Section:
        """The layers."""
        return section(TARGETS[self.tire])

    @property
    def mesh(self) -> Mesh:
        """The mesh."""
        return mesh(self.section, self.fineness)

    def deck(self) -> str:
        """Input of the job."""
        contact = replace(self.contact, friction=self.friction)
        return contact_deck(self.section, self.mesh, contact, self.touch, self.loads)


STORED = tuple(
    [Case(tire, mu) for tire in ("solid", "blocks") for mu in (0.5, 0.0)]
    + [Case("stretchy", mu, touch=Touch(gap=1.5e-3, travel=3.25e-3)) for mu in (0.5, 0.0)]
    + [Case("solid", 1.0)]
    + [Case("slack", 0.0, touch=Touch(load=80.0, load_increment=150.0), loads=SLACK_LOADS)]
)
CHECKS = (
    Case("solid", 0.5, COARSE, "coarse"),
    Case("solid", 0.5, COARSE, "path", touch=Touch(load_increment=150.0)),
    Case("solid", 0.5, COARSE, "stiff", Contact(0.0, normal=2.0e11, stick=4.0e10)),
    Case("solid", 0.0, COARSE, "coarse"),
    Case("solid", 0.0, FINE, "fine", loads=LOADS[:2]),
)
"""Against the stored cases: other meshes; and against the coarse mesh: half the increments, four
times the penalty stiffness."""
