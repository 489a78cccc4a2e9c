"""Which terms an estimator may use: candidates of growing size, chosen by cross-validation.

The load may take up further families of terms, see `tirelib.estimators.grow`.

Symmetry decides most of it. Fz is even in left and right, so it takes even regressors and products
of two odd ones; Fy and the slip angle are odd, so every term holds an odd number of odd regressors.
Regressors that do not vary in the data are left out.
"""

from collections.abc import Collection, Iterable, Sequence

from tirelib.estimators.regressors import ODD, SHAPE

Powers = dict[str, int]
"""A term by regressor name; an empty one is the constant."""


def times(*factors: Powers) -> Powers:
    """Multiply terms.

    Examples
    --------
    >>> times({"a": 1}, {"a": 1, "b": 2})
    {'a': 2, 'b': 2}
    """
    product: Powers = {}
    for factor in factors:
        for name, power in factor.items():
            product[name] = product.get(name, 0) + power
    return product


def grid(first: Iterable[Powers], second: Iterable[Powers]) -> list[Powers]:
    """Return all products of a term of `first` with one of `second`."""
    second = list(second)
    return [times(a, b) for a in first for b in second]


ONE: Powers = {}
L1, L2, L3 = ({"contact_angle": k} for k in (1, 2, 3))
C1, C2 = {"compression": 1}, {"compression": 2}
T1, T2 = {"traction": 1}, {"traction": 2}
P1, P2 = {"pressure": 1}, {"pressure": 2}
V = {"speed_squared": 1}
G1, G2 = {"camber": 1}, {"camber": 2}


def load_candidates(varying: Collection[str]) -> list[list[Powers]]:
    """Return candidate term lists for Fz, from the dissertation's quadratic upwards."""
    quadratic = [ONE, L1, L2]
    least: list[Powers] = [P1, times(P1, L1)] if "pressure" in varying else []
    least += [V] if "speed_squared" in varying else []
    least += [T1, T2] if "traction" in varying else []
    bent = [*quadratic, L3, C1, times(C1, L1), C2]
    conditions: list[Powers] = []
    if "pressure" in varying:
        conditions += grid([P1], [ONE, L1, L2]) + grid([P2], [ONE, L1]) + [times(P1, C1)]
    if "speed_squared" in varying:
        conditions += grid([V], [ONE, L1, L2])
    if "traction" in varying:
        conditions += [T1, T2, times(T1, L1), times(T2, L1), times(T2, T2)]
        conditions += [times(T1, T2), times(T1, C1), times(T2, C1)]
    skewed = [
        times({a: 1}, {b: 1})
        for a, b in (
            ("angle_slope", "angle_slope"),
            ("cp1_slope", "cp1_slope"),
            ("tp_slope", "tp_slope"),
            ("angle_slope", "cp1_slope"),
        )
        if a in varying and b in varying
    ]
    if "camber" in varying:
        skewed += [G2, times(G1, {"cp1_slope": 1})]
    return _unique(
        [quadratic + least, quadratic + conditions, bent + conditions, bent + conditions + skewed]
    )


def load_families(varying: Collection[str]) -> dict[str, list[Powers]]:
    """Return families of terms by name; Fz may take up any of them, whole: the contact's shape.

    A regressor of the shape comes alone and with the contact angle; what changes with traction
    also with the traction, and what is not across the width squared. The last two families are the
    products of two slopes, and some of them with the contact angle.
    """
    traction = [T1] if "traction" in varying else []
    families: dict[str, list[Powers]] = {}
    for name, square, others in (
        ("angle_bow", False, traction),
        ("tp_bow", False, traction),
        ("cp1_bow", False, traction),
        ("cp2_bow", False, traction),
        ("fullness", True, []),
        ("skew", True, traction),
        ("steepness", True, []),
        ("steepness_change", True, traction),
    ):
        if name in varying:
            alone: Powers = {name: 1}
            squared = [times(alone, alone)] if square else []
            families[name] = [*grid([alone], [ONE, L1, *others]), *squared]
    bends: list[Powers] = [{name: 1} for name in ("lead_bend", "trail_bend") if name in varying]
    odd: list[Powers] = [{name: 1} for name in ODD if name in varying]
    pairs = [times(a, b) for i, a in enumerate(odd) for b in odd[i:]]
    families |= {"bends": grid(bends, [ONE, L1])} if bends else {}
    families |= {"slopes": pairs, "slopes with angle": grid(pairs, [L1])} if pairs else {}
    return families


def force_candidates(varying: Collection[str]) -> list[list[Powers]]:
    """Return candidate term lists for Fy."""
    odd = [{name: 1} for name in ("cp1_slope", "cp2_slope", "angle_slope", "tp_slope")]
    even: list[Powers] = [ONE, L1, L2]
    extra: list[Powers] = []
    if "traction" in varying:
        even += [T1, T2]
    if "camber" in varying:
        extra += [*grid([G1], [ONE, L1, C1]), times({"cp1_slope": 2}, G1)]
        extra += [times({"cp1_slope": 1}, G2)]
    cubes = [{name: 3} for name in ("cp1_slope", "cp2_slope", "tp_slope")]
    pressure = grid(odd, [P1]) if "pressure" in varying else []
    speed = grid(odd[:2], [V]) if "speed_squared" in varying else []
    conditions = pressure + speed
    return _unique(
        [
            [ONE, *grid(odd[:3], even[:2]), *extra],
            [ONE, *grid(odd, even), *extra, *conditions],
            [ONE, *grid(odd, even), *cubes, *extra, *conditions],
            [ONE, *grid(odd, [*even, L3]), *cubes, *extra, *conditions],
        ]
    )


def force_families(varying: Collection[str]) -> dict[str, list[Powers]]:
    """Return families of terms by name that Fy may take up whole, all odd.

    The slopes and the camber with one regressor of the shape; and products of three of them.
    """
    slopes: list[Powers] = [{name: 1} for name in ODD]
    camber = [G1] if "camber" in varying else []
    families = {name: grid([*slopes, *camber], [{name: 1}]) for name in SHAPE if name in varying}
    pairs = [times(a, b) for i, a in enumerate(slopes) for b in slopes[i:]]
    families["cubes"] = _unique([grid(pairs, slopes)])[0]
    if camber:
        families["cubes with camber"] = grid(camber, pairs)
    return families


def angle_candidates(varying: Collection[str]) -> list[list[Powers]]:
    """Return candidate term lists for the slip angle, in lateral utilisation Fy/Fz and load."""
    loads: list[Powers] = [ONE, {"load": 1}, {"load": 2}] if "load" in varying else [ONE]
    x1, x2, x3, x4 = ({"utilisation": k} for k in (1, 2, 3, 4))
    extra: list[Powers] = []
    if "camber" in varying:
        extra += [G1, times(G1, x2), times(x1, G2), times(G1, x4), times(x3, G2)]
        extra += [times(G1, {"load": 1})] if "load" in varying else []
    if "traction" in varying:
        extra += grid([x1, x3], [T1, T2])
    if "slip_ratio" in varying:
        extra += [*grid([x1, x3], [{"slip_size": 1}]), times(x1, {"slip_ratio": 2})]
    pressure = grid([x1, x3], [P1]) if "pressure" in varying else []
    lists = []
    for degree in (3, 5, 7):
        powers: list[Powers] = [{"utilisation": k} for k in range(1, degree + 1, 2)]
        for evens in (loads[:2], loads):
            lists.append([ONE, *grid(powers, evens), *extra, *pressure])
    return _unique(lists)


def radius_candidates(varying: Collection[str]) -> list[list[Powers]]:
    """Return candidate term lists for the effective rolling radius."""
    terms: list[Powers] = [ONE]
    if "load" in varying:
        terms += [{"load": 1}]
    if "pressure" in varying:
        terms += [P1]
    if "speed_squared" in varying:
        terms += [V]
    richer = list(terms)
    if "load" in varying:
        richer += [{"load": 2}]
        if "pressure" in varying:
            richer += [times(P1, {"load": 1}), P2]
    bent = [*richer, {"load": 3}] if "load" in varying else richer
    most = [*bent, {"load": 4}] if "load" in varying else bent
    return _unique([[ONE], terms, richer, bent, most])


def _unique(lists: Sequence[list[Powers]]) -> list[list[Powers]]:
    """Drop repeated terms within a list, and repeated lists."""
    kept: list[list[Powers]] = []
    for terms in lists:
        once: list[Powers] = []
        for term in terms:
            if term not in once:
                once.append(term)
        if once not in kept:
            kept.append(once)
    return kept
