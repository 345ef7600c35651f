"""What a notebook shows of results: a small table, and the circle."""

from html import escape

import numpy as np

from . import _paths

ROWS = 12


def identified(found):
    uncertainty = found.standard_uncertainty
    rows = [(name, f"{v:+.3e}", f"{2 * uncertainty[name]:.1e}") for name, v in found.parameters.items()]
    title = f"{len(rows)} parameters, noise {found.noise_um:.2f} µm"
    if found.unseen:
        title += f"; not identified: {', '.join(found.unseen)}"
    head = ("parameter", "mm, rad", "± (k = 2)")
    return page(title, table(head, rows), circle(found.errors), found.warnings)


def errors(model):
    uncertainty = model.standard_uncertainty
    band = lambda name: f"{2 * uncertainty[name]:.1e}" if name in uncertainty else ""
    rows = [(name, f"{v:+.3e}", band(name)) for name, v in model.parameters.items()]
    title = f"Errors of {model.machine.name}"
    return page(title, table(("parameter", "mm, rad", "± (k = 2)"), rows), circle(model))


def compensation(made):
    verification, picture = made.verification, ""
    rows = [("policy", made.policy), ("axes", ", ".join(made.axes)), ("size", f"{len(made.to_bytes())} bytes")]
    if verification is not None:
        um = lambda found: f"{found['translation_um']['max']:.3g} µm"
        met = "" if verification["meets_tolerance"] else " (missed)"
        rows += [
            ("largest error of the tip", um(verification["before"])),
            ("with the tables", um(verification["after"])),
            ("tolerance", f"{verification['tolerance_um']:g} µm{met}"),
            ("tables", str(verification["tables"])),
        ]
        picture = circle(made._source[1], made)
    return page(f"Compensation of {made.machine}", table((), rows), picture, made.warnings)


def machine(described):
    rows = [
        (letter, f"{low:g}", f"{high:g}", "deg" if letter in "ABC" else "mm")
        for letter, (low, high) in zip(described.axes, described.travel)
    ]
    return page(f"{described.name}: {described.topology}", table(("axis", "from", "to", ""), rows))


def page(title, *parts):
    *shown, last = parts
    if isinstance(last, list):
        last = "".join(f"<p>⚠ {escape(one)}</p>" for one in last)
    boxes = "".join(f"<div>{part}</div>" for part in [*shown, last] if part)
    return f'<div><b>{escape(title)}</b><div style="display:flex;flex-wrap:wrap;gap:1em">{boxes}</div></div>'


def table(head, rows):
    cells = lambda kind, row: "".join(f"<{kind}>{escape(cell)}</{kind}>" for cell in row)
    body = "".join(f"<tr>{cells('td', row)}</tr>" for row in rows[:ROWS])
    more = f"<p>and {len(rows) - ROWS} more</p>" if len(rows) > ROWS else ""
    return f"<table><thead><tr>{cells('th', head)}</tr></thead><tbody>{body}</tbody></table>{more}"


def circle(model, made=None):
    """The circle in XY that a ball-bar would find, as SVG; nothing for a machine without X and Y."""
    if not {"X", "Y"} <= set(model.machine.axes):
        return ""
    angles, before, radius = _paths.circle(model)
    found = [(before, "#c0392b", "without tables")]
    if made is not None:
        found.append((_paths.circle(model, made)[1], "#1f77b4", "with tables"))
    end = _paths.scale(before)
    lines = "".join(
        f'<polyline points="{points(angles, deviation / end)}" fill="none" stroke="{colour}" stroke-width="1.5">'
        f"<title>{name}</title></polyline>"
        for deviation, colour, name in found
    )
    names = "".join(
        f'<text x="{8 + 105 * k}" y="250" fill="{colour}">{name}</text>' for k, (_, colour, name) in enumerate(found)
    )
    return (
        '<svg xmlns="http://www.w3.org/2000/svg" width="240" height="256" font-family="sans-serif" font-size="11" '
        'role="img"><title>Circular test in XY</title>'
        '<circle cx="120" cy="122" r="70" fill="none" stroke="#888" stroke-dasharray="3 3"/>'
        '<circle cx="120" cy="122" r="110" fill="none" stroke="#888" stroke-width="0.5"/>'
        f'{lines}<text x="8" y="9" fill="#888">XY, radius {radius:g} mm; rings {end:g} µm apart</text>{names}</svg>'
    )


def points(angles, deviation):
    """On a circle of 70 units, one unit of deviation being 40."""
    size = 70 + 40 * deviation
    x, y = 120 + size * np.cos(angles), 122 - size * np.sin(angles)
    return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y))
