#!/usr/bin/python3
"""Writes sunlit.glb and level.glb beside itself (or into the folder that is named): same bytes every time.

make_scenes.py [FOLDER]"""
import math
import os
import sys

import numpy as np

from mesh import Mesh, unit, vec

X, Y, Z = vec(1, 0, 0), vec(0, 1, 0), vec(0, 0, 1)
SKY = {"type": "gradient", "zenith": [0.25, 0.45, 0.95], "horizon": [0.9, 0.95, 1.0], "ground": [0.12, 0.11, 0.09]}


def leaves(rng, size=64, count=70):
    """White texels whose alpha is 1 inside random ellipses."""
    y, x = (np.mgrid[0:size, 0:size] + 0.5) / size
    alpha = np.zeros((size, size), bool)
    for _ in range(count):
        cx, cy, a = rng.uniform(0.08, 0.92), rng.uniform(0.08, 0.92), rng.uniform(0, math.pi)
        u, v = (x - cx) * math.cos(a) + (y - cy) * math.sin(a), (y - cy) * math.cos(a) - (x - cx) * math.sin(a)
        alpha |= (u / 0.075) ** 2 + (v / 0.035) ** 2 < 1
    rgba = np.full((size, size, 4), 255, np.uint8)
    rgba[..., 3] = 255 * alpha
    return rgba


def cards(mesh, rng, middle, radius, count, size):
    """Foliage: masked squares of random directions around a point."""
    for _ in range(count):
        n, a = unit(rng.normal(size=3)), rng.normal(size=3)
        u = unit(np.cross(n, a)) * size
        v = np.cross(n, u)
        mesh.face(middle + unit(rng.normal(size=3)) * radius * rng.uniform(0.3, 1) - u / 2 - v / 2, u, v, "_leaves")


def wall(mesh, a, b, base, height, thickness, material, holes=(), back=None, rims="", rim=None):
    """A wall over the line from a to b (x, z); its front is on the left of someone who walks from a to b with +Y as head."""
    start, end = vec(a[0], base, a[1]), vec(b[0], base, b[1])
    mesh.plate(start, end - start, height * Y, thickness, material, back, rim, holes, rims)


def steps(mesh, foot, along, across, rise, run, count, material):
    """Solid steps that climb along `along` (a unit vector); `across`, their width, points to the climber's right."""
    for i in range(count):
        at, top = foot + along * run * i, rise * (i + 1)
        mesh.face(at + rise * i * Y, across, rise * Y, material)
        mesh.face(at + top * Y, across, along * run, material)
        mesh.face(at + across, along * run, top * Y, material)
        mesh.face(at + along * run, -along * run, top * Y, material)


# ---- sunlit: a courtyard with houses, a colonnade, steps, a pergola, trees and a bank


def terrain(mesh, half, material):
    """Ground over [-half, half]^2: flat, with banks to the east and west. Its edges lie on texel borders of one chart."""
    tpm = mesh.texels_per_metre
    texels = round(2 * half * tpm)
    knots = [0, 6, 12, 18, 24, texels // 2, texels - 24, texels - 18, texels - 12, texels - 6, texels]
    heights = [1.9, 1.7, 1.2, 0.5, 0, 0, 0, 0.9, 2.0, 2.7, 3.0]
    chart = mesh.chart((2 * half, 2 * half))
    rows = np.linspace(0, texels, 13).round()
    at = lambda i, row: vec(-half + 2 * half * knots[i] / texels, heights[i], half - 2 * half * row / texels)
    for i in range(len(knots) - 1):
        for r0, r1 in zip(rows, rows[1:]):
            corners = np.array([at(i, r0), at(i + 1, r0), at(i + 1, r1), at(i, r1)])
            chart["quads"].append((corners, np.array([(knots[i], r0), (knots[i + 1], r0), (knots[i + 1], r1), (knots[i], r1)]), material))


def house(mesh, low, size, height, paint, roof, gable):
    """A hollow house with doors and windows under a flat slab or a gable roof along z."""
    (x, z), (w, d) = low, size
    t, sunk = 0.3, 0.05
    windows = lambda l: [(s - 0.5, s + 0.5, 1.0 + sunk, 2.3 + sunk) for s in np.arange(1.5 + t / 2, l - 1, 2.6)]
    h, o = height + sunk, t / 2
    door = [(w / 2 + o - 0.6, w / 2 + o + 0.6, 0, 2.2 + sunk)]
    beside_door = [hole for hole in windows(w) if abs(hole[0] + 0.5 - w / 2 - o) > 1.3]
    wall(mesh, (x - o, z + d), (x + w + o, z + d), -sunk, h, t, paint, beside_door + door, "inside")
    wall(mesh, (x + w + o, z), (x - o, z), -sunk, h, t, paint, windows(w), "inside")
    wall(mesh, (x, z - o), (x, z + d + o), -sunk, h, t, paint, windows(d), "inside")
    wall(mesh, (x + w, z + d + o), (x + w, z - o), -sunk, h, t, paint, windows(d), "inside")
    low = vec(x, height, z)
    if not gable:
        mesh.plate(low + vec(-0.5, 0.1, d + 0.5), vec(w + 1, 0, 0), vec(0, 0, -d - 1), 0.25, roof, "inside", rims="lrbt")
        return
    up = 0.35 * w
    for side, at in ((1, z + d + 0.15), (-1, z - 0.15)):
        a, b = vec(x - 0.15, height, at), vec(x + w + 0.15, height, at)
        a, b = (a, b) if side > 0 else (b, a)
        mesh.triangle(a, b, (a + b) / 2 + up * Y, paint)
    ridge, eave = low + vec(w / 2, up + 0.05, d + 0.6), vec(-w / 2 - 0.5, -up * (1 + 1 / w), 0)
    mesh.plate(ridge + eave, -eave, vec(0, 0, -d - 1.2), 0.15, roof, "inside")
    mesh.plate(ridge, eave * vec(-1, 1, 1), vec(0, 0, -d - 1.2), 0.15, roof, "inside")


def sunlit(folder):
    rng = np.random.default_rng(1)
    mesh = Mesh("sunlit", 256, 3.8)
    terrain(mesh, 18, "grass")
    mesh.face(vec(-150, -0.4, 150), 300 * X, -300 * Z, "_meadow")
    house(mesh, (-11, -9), (7, 6), 3.2, "plaster", "tiles", True)
    house(mesh, (3.5, 4.5), (7, 5), 3.4, "ochre", "slate", False)
    house(mesh, (-10.5, 6), (4, 4), 7.0, "brick", "slate", False)
    # A colonnade along the north side.
    wall(mesh, (-2, -14), (12, -14), -0.05, 3.9, 0.4, "plaster", rims="lrt")
    mesh.plate(vec(-2.5, 3.55, -9.8), 15 * X, -4.6 * Z, 0.3, "slate", "plaster")
    for i in range(8):
        mesh.box(vec(-1.5 + 1.85 * i, -0.02, -10.4), (0.7, 0.35, 0.7), 0, "stone")
        mesh.column(vec(-1.5 + 1.85 * i, 0.3, -10.4), 0.22, 3.15, "stone")
    # A platform with steps, a basin and an obelisk.
    mesh.box(vec(0, -0.02, 0.5), (5, 0.62, 4), 0, "stone")
    steps(mesh, vec(-1.5, 0, 3.4), -Z, 3 * X, 0.15, 0.3, 3, "stone")
    mesh.box(vec(0, 0.58, 0.5), (1.0, 0.6, 1.0), 0.5, "stone")
    mesh.box(vec(0, 1.16, 0.5), (0.5, 2.4, 0.5), 0.5, "brick")
    # A pergola.
    for x in (4, 9):
        for z in (-5, -1.5):
            mesh.box(vec(x, -0.02, z), (0.25, 2.62, 0.25), 0, "wood")
    for z in (-5, -1.5):
        mesh.box(vec(6.5, 2.58, z), (5.8, 0.2, 0.2), 0, "wood", bottom="wood")
    for i in range(9):
        mesh.box(vec(4.1 + 0.6 * i, 2.76, -3.25), (0.12, 0.2, 4.4), 0, "wood", bottom="wood")
    # Walls of the yard, a gate, crates, trees.
    wall(mesh, (-13, 13), (13, 13), -0.05, 2.25, 0.35, "brick", [(12, 14.5, 0, 2.0)], rims="lrt")
    for k, (x, z) in enumerate([(2.2, 9), (3.0, 9.6), (-5.5, 0.5), (10.5, -6), (10, -7.2), (-4.6, 4.5)]):
        mesh.box(vec(x, -0.02, z), (0.9, 0.7 + 0.15 * (k % 3), 0.8), 0.4 + 0.9 * k, "wood")
    for x, z in [(-3, -7.5), (-12, 1), (1.5, 11), (12, 10.5), (12, 1.5), (-6, 11.5)]:
        mesh.column(vec(x, -0.05, z), 0.16, 2.6, "wood", 6)
        cards(mesh, rng, vec(x, 3.4, z), 1.3, 26, 1.3)
    mesh.light("directional", direction=vec(-0.55, -0.62, -0.5), intensity=6.0, color=[1.0, 0.92, 0.8], extras={"angularDiameterDeg": 0.53})
    albedo = {"grass": (0.16, 0.28, 0.09), "plaster": (0.75, 0.72, 0.66), "ochre": (0.62, 0.4, 0.16), "brick": (0.45, 0.16, 0.1), "stone": (0.5, 0.49, 0.46),
              "tiles": (0.5, 0.14, 0.08), "slate": (0.16, 0.17, 0.2), "inside": (0.7, 0.7, 0.68), "wood": (0.42, 0.27, 0.13), "_meadow": (0.2, 0.27, 0.1)}
    materials = {name: {"albedo": rgb} for name, rgb in albedo.items()}
    materials["_leaves"] = {"albedo": (0.14, 0.34, 0.08), "leaves": True}
    camera = {"position": [15, 8.5, 20], "target": [-1, 0.5, -1.5], "fovYDeg": 42}
    mesh.write(os.path.join(folder, "sunlit.glb"), materials, SKY, camera, leaves(rng))


# ---- level: rooms, corridors and a hall on two floors

WIDTH, DEPTH, STOREY, CLEAR = 28.0, 20.0, 3.5, 3.2
SUNK, THIN = 0.02, 0.1
# Rooms as (x0, x1, z0, z1, paint, lamps or None for a dark room), for each floor.
ROOMS = [
    [(0, 10, 0, 6, "white", 3), (0, 10, 6, 12, "sand", 2), (10, 18, 0, 12, "white", 3), (18, 28, 0, 6, "blue", 0), (18, 28, 6, 12, "white", 3),
     (0, 28, 12, 14.5, "grey", 4), (0, 9, 14.5, 20, "green", 2), (9, 18, 14.5, 20, "white", 2), (18, 28, 14.5, 20, "red", 3)],
    [(0, 5, 0, 12, "green", 2), (5, 10, 0, 12, "white", 2), (10, 18, 0, 12, "white", 2), (18, 28, 0, 7, "sand", 3), (18, 28, 7, 12, "blue", 2),
     (0, 28, 12, 14.5, "grey", 4), (0, 14, 14.5, 20, "white", 4), (14, 28, 14.5, 20, "red", 0)]]
# Inner walls as (from, to, paint in front, paint behind, doors along it as (middle, width, height)).
WALLS = [
    [((10, 0), (10, 12), "white", "white", [(3.5, 1.2, 2.1), (9.2, 1.0, 2.1)]), ((18, 0), (18, 12), "blue", "white", [(3.0, 0.9, 2.1), (8.5, 1.2, 2.3)]),
     ((0, 6), (10, 6), "sand", "white", [(7.5, 1.0, 2.1)]), ((18, 6), (28, 6), "white", "blue", []),
     ((0, 12), (28, 12), "grey", "white", [(4.5, 1.0, 2.1), (14, 3.6, 2.6), (22.5, 1.0, 2.1)]),
     ((0, 14.5), (28, 14.5), "white", "grey", [(3.5, 1.0, 2.1), (13.5, 1.6, 2.1), (20.5, 1.0, 2.1)]),
     ((9, 14.5), (9, 20), "white", "green", []), ((18, 14.5), (18, 20), "red", "white", [(3.0, 1.0, 2.1)])],
    [((5, 0), (5, 12), "white", "green", [(5.5, 1.0, 2.1)]), ((10, 0), (10, 12), "white", "white", [(2.6, 1.2, 2.1)]),
     ((18, 0), (18, 12), "sand", "white", [(2.5, 1.0, 2.1)]), ((18, 7), (28, 7), "blue", "sand", [(2.0, 1.0, 2.1)]),
     ((0, 12), (28, 12), "grey", "white", [(3.5, 1.0, 2.1), (14, 3.0, 2.5), (24.5, 1.0, 2.1)]),
     ((0, 14.5), (28, 14.5), "white", "grey", [(5.5, 1.0, 2.1), (14.8, 1.4, 2.1)]), ((14, 14.5), (14, 20), "red", "white", [])]]
WELL = (10.5, 12.3, 5.1, 10.9)  # stairwell: x0, x1, z0, z1


def hull(mesh):
    """Outer walls with windows, floors, ceilings, the roof with its skylight, the ground outside."""
    base, height, t = -0.1, STOREY + CLEAR + SUNK + 0.1, 0.3
    sills = (0.9 - base, 2.3 - base), (STOREY + 0.9 - base, STOREY + 2.3 - base)
    windows = lambda spans: [(a, b, *sills[floor]) for floor in (0, 1) for a, b in spans[floor]]
    west = [[(2, 4.2), (8, 9.4), (12.8, 13.8), (16, 18.5)], [(2.5, 4), (8, 9.5), (12.8, 13.8), (16, 18)]]
    east = [[(2.6, 3.2), (7.5, 10.5), (12.8, 13.8), (16, 18.5)], [(2, 5), (8.5, 10), (12.8, 13.8), (16.5, 17.1)]]
    south = [[(1.5, 3.5), (5, 7), (10.5, 12.5), (14.5, 16.5), (20, 22), (24, 26)], [(2, 4), (6, 8), (10, 12), (18, 18.6)]]
    north = [[(2, 4), (6, 8), (12, 16)], [(1.5, 3), (6.5, 8.5), (12, 16), (20, 22), (24, 26)]]
    shifted = lambda spans: [[(a + t, b + t) for a, b in s] for s in spans]
    turned = lambda spans, size: [[(size + t - b, size + t - a) for a, b in s] for s in spans]
    o = t / 2
    wall(mesh, (-o, DEPTH + t), (-o, -t), base, height, t, "white", windows(turned(west, DEPTH)), "_facade", "", "sill")
    wall(mesh, (WIDTH + o, -t), (WIDTH + o, DEPTH + t), base, height, t, "white", windows(shifted(east)), "_facade", "", "sill")
    wall(mesh, (WIDTH + t, DEPTH + o), (-t, DEPTH + o), base, height, t, "white", windows(turned(south, WIDTH)), "_facade", "", "sill")
    wall(mesh, (-t, -o), (WIDTH + t, -o), base, height, t, "white", windows(shifted(north)), "_facade", "", "sill")
    e = 0.05
    u, v = (WIDTH + 2 * e) * X, -(DEPTH + 2 * e) * Z
    hole = lambda x0, x1, z0, z1: (x0 + e, x1 + e, DEPTH + e - z1, DEPTH + e - z0)
    corner = lambda y: vec(-e, y, DEPTH + e)
    mesh.face(corner(0), u, v, "concrete")
    mesh.plate(corner(STOREY - 0.15), u, v, 0.3, "carpet", "ceiling", "sill", [hole(*WELL), hole(13.5, 16, 3, 8)], "")
    mesh.plate(corner(2 * STOREY - 0.15), u, v, 0.3, "_facade", "ceiling", "sill", [hole(13, 16.5, 3, 8)], "lrbt")
    mesh.face(vec(-100, -0.05, 100), 250 * X, -250 * Z, "_ground")


def room(mesh, rng, floor, x0, x1, z0, z1, lamps):
    """Lamps under the ceiling (one in four is a spot), crates, shelves or a table."""
    y, inset = floor * STOREY, 1.0
    corridor = z1 - z0 < 3
    for i in range(lamps):
        at = (i + 0.5) / lamps
        wide = x1 - x0 > z1 - z0
        x = x0 + (x1 - x0) * (at if wide else rng.uniform(0.35, 0.65))
        z = z0 + (z1 - z0) * (rng.uniform(0.35, 0.65) if wide else at)
        colour = [1.0, float(rng.uniform(0.7, 0.95)), float(rng.uniform(0.45, 0.9))]
        if rng.uniform() < 0.25:
            aim = vec(rng.uniform(-0.5, 0.5), -1, rng.uniform(-0.5, 0.5))
            mesh.light("spot", vec(x, y + CLEAR - 0.15, z), aim, intensity=float(rng.uniform(8, 16)), color=colour, spot={"innerConeAngle": 0.35, "outerConeAngle": 0.8})
        else:
            mesh.light("point", vec(x, y + CLEAR - 0.45, z), intensity=float(rng.uniform(2, 5)), color=colour)
    for _ in range(2 if corridor else int(rng.integers(3, 6))):
        x, z = rng.uniform(x0 + inset, x1 - inset), rng.uniform(z0 + inset, z1 - inset)
        side = rng.uniform(0.45, 0.95) * (0.5 if corridor else 1)
        if WELL[0] - 1 < x < 17 and 2 < z < WELL[3] + 1:
            continue
        yaw = rng.uniform(0, 3)
        paint = ("crate", "steel", "red", "blue")[rng.integers(4)]
        mesh.box(vec(x, y - SUNK, z), (side, 0.8 * side, side), yaw, paint)
        if rng.uniform() < 0.5:
            mesh.box(vec(x + 0.1, y + 0.8 * side - 2 * SUNK, z), (0.6 * side, 0.5 * side, 0.6 * side), yaw + 0.6, "crate")


def shelf(mesh, foot, yaw, width, levels):
    """A bookcase of thin boards."""
    x, z = vec(math.cos(yaw), 0, -math.sin(yaw)), vec(math.sin(yaw), 0, math.cos(yaw))
    height = 0.42 * levels
    for s in (-1, 1):
        mesh.box(foot + s * (width / 2) * x - SUNK * Y, (0.03, height + 0.1, 0.32), yaw, "wood")
    for i in range(levels):
        mesh.box(foot + (0.1 + 0.42 * i) * Y, (width - 0.02, 0.03, 0.3), yaw, "wood", bottom="wood")
    mesh.box(foot - 0.15 * z - SUNK * Y, (width, height + 0.06, 0.015), yaw, "wood")


def table(mesh, foot, yaw):
    x, z = vec(math.cos(yaw), 0, -math.sin(yaw)), vec(math.sin(yaw), 0, math.cos(yaw))
    mesh.box(foot + 0.72 * Y, (1.6, 0.04, 0.8), yaw, "wood", bottom="wood")
    for s in (-1, 1):
        for t in (-1, 1):
            mesh.box(foot + 0.7 * s * x + 0.32 * t * z - SUNK * Y, (0.06, 0.75, 0.06), yaw, "steel")


def level(folder):
    rng = np.random.default_rng(2)
    mesh = Mesh("level", 512, 6.2)
    hull(mesh)
    for floor, walls in enumerate(WALLS):
        for a, b, front, back, doors in walls:
            a, b = np.array(a, float), np.array(b, float)
            along = (b - a) / np.abs(b - a).sum()
            holes = [(m - w / 2 + SUNK, m + w / 2 + SUNK, 0, h + SUNK) for m, w, h in doors]
            wall(mesh, a - SUNK * along, b + SUNK * along, floor * STOREY - SUNK, CLEAR + 2 * SUNK, THIN, front, holes, back, "", "frame")
        for x0, x1, z0, z1, _, lamps in ROOMS[floor]:
            room(mesh, rng, floor, x0, x1, z0, z1, lamps)
    # The stairs, and parapets around the well and the void over the hall.
    steps(mesh, vec(WELL[0], 0, 10.5), -Z, (WELL[1] - WELL[0]) * X, STOREY / 18, 0.3, 18, "concrete")
    for a, b in [((WELL[1], 10.9), (WELL[1], 5.1)), ((WELL[0], 10.9), (WELL[1], 10.9)), ((WELL[0], 5.1), (WELL[0], 10.9)), ((13.5, 3), (16, 3)), ((16, 3), (16, 8)), ((16, 8), (13.5, 8)), ((13.5, 8), (13.5, 3))]:
        wall(mesh, a, b, STOREY - SUNK, 1.0, 0.06, "wood", rims="lrt")
    for floor in (0, 1):
        y = floor * STOREY
        for x, z in [(13.0, 1.5), (16.6, 1.5), (13.0, 9.5), (16.6, 9.5)]:
            mesh.column(vec(x, y - SUNK, z), 0.2, CLEAR + 2 * SUNK, "concrete")
        for x in (2, 7.5, 17.5, 23):
            mesh.column(vec(x, y - SUNK, 12.25), 0.12, CLEAR + 2 * SUNK, "steel", 6)
        for x in (4.2, 10, 20, 25.5):  # light panels in the corridor
            mesh.box(vec(x, y + CLEAR - 0.06, 13.3), (1.2, 0.08, 0.3), 0, "steel", bottom="panel")
        for k, (x, z) in enumerate([(3, 17), (12, 18), (23, 9.5), (21.5, 3.2)]):
            table(mesh, vec(x, y, z), 0.3 + k)
        for k, (x, z, yaw) in enumerate([(2.5, 0.25, 0), (8.7, 4.0, -1.57), (26, 6.4 + floor, 0), (0.25, 9, 1.57), (7.5, 14.85, 0), (24, 19.7, 3.14159)]):
            shelf(mesh, vec(x, y, z), yaw, 1.2 + 0.2 * (k % 3), 4)
        for x, z in [(9.3, 11.3), (17.4, 0.7), (27.4, 13.9), (0.6, 19.3)]:  # plants
            mesh.box(vec(x, y - SUNK, z), (0.36, 0.4, 0.36), 0.4, "red")
            cards(mesh, rng, vec(x, y + 0.85, z), 0.25, 8, 0.6)
    for at, yaw, paint in [(vec(18.09, 1.0, 9.8), 1.5708, "screen"), (vec(9.12, 1.0, 18.5), 1.5708, "alarm"), (vec(22, STOREY + 1.0, 7.09), 0, "screen"), (vec(5.09, STOREY + 1.0, 9), 1.5708, "alarm")]:
        x, z = vec(math.cos(yaw), 0, -math.sin(yaw)), vec(math.sin(yaw), 0, math.cos(yaw))
        mesh.box(at, (1.1, 0.7, 0.1), yaw, "steel", bottom="steel")
        mesh.face(at + 0.052 * z - 0.5 * x + 0.05 * Y, 1.0 * x, 0.6 * Y, paint)
    mesh.box(vec(21.3, -SUNK, 14.9), (0.9, 2.1, 0.04), 0.9, "wood")  # doors ajar
    mesh.box(vec(5.4, STOREY - SUNK, 14.95), (0.9, 2.1, 0.04), 1.9, "wood")
    mesh.light("directional", direction=vec(0.42, -0.55, -0.72), intensity=5.0, color=[1.0, 0.9, 0.75], extras={"angularDiameterDeg": 0.53})
    albedo = {"white": (0.74, 0.73, 0.7), "sand": (0.68, 0.56, 0.38), "blue": (0.12, 0.22, 0.5), "green": (0.25, 0.48, 0.26), "red": (0.6, 0.12, 0.1), "grey": (0.5, 0.5, 0.52),
              "concrete": (0.42, 0.42, 0.4), "carpet": (0.3, 0.16, 0.14), "ceiling": (0.8, 0.8, 0.79), "sill": (0.6, 0.58, 0.55), "frame": (0.4, 0.28, 0.16), "wood": (0.48, 0.32, 0.17),
              "steel": (0.35, 0.37, 0.4), "crate": (0.55, 0.42, 0.22), "_facade": (0.5, 0.45, 0.4), "_ground": (0.25, 0.26, 0.18)}
    materials = {name: {"albedo": rgb} for name, rgb in albedo.items()}
    materials["_leaves"] = {"albedo": (0.14, 0.34, 0.08), "leaves": True}
    for name, radiance in {"panel": (9.0, 9.5, 10.0), "screen": (0.6, 1.6, 2.6), "alarm": (3.0, 0.5, 0.2)}.items():
        materials[name] = {"albedo": (0.3, 0.3, 0.3), "emission": radiance}
    camera = {"position": [17.6, 2.3, 11.6], "target": [12.3, 1.9, 4], "fovYDeg": 62}
    mesh.write(os.path.join(folder, "level.glb"), materials, SKY, camera, leaves(rng))


if __name__ == "__main__":
    target = sys.argv[1] if len(sys.argv) > 1 else os.path.dirname(os.path.abspath(__file__))
    sunlit(target)
    level(target)
