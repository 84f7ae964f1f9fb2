#!/usr/bin/env python3
"""checker.py IN.obj OUT.png [CUT_Y]: what `bakewell unwrap` wrote, seen from outside (faces that face away, or reach above CUT_Y, are
left out), a checker of 4 x 4 texels on it, tinted by chart. Squares must look square and equal everywhere."""
import math
import struct
import sys
import zlib

WIDTH, HEIGHT, CELL = 960, 640, 4


def read(path):
    positions, uvs, faces, chart, size = [], [], [], 0, (1, 1)
    for line in open(path):
        word = line.split()
        if not word:
            continue
        if line.startswith("# atlas"):
            size = (int(word[2]), int(word[3]))
        elif word[0] == "v":
            positions.append(tuple(map(float, word[1:4])))
        elif word[0] == "vt":
            uvs.append((float(word[1]) * size[0], float(word[2]) * size[1]))
        elif word[0] == "g":
            chart = int(word[1][6:]) if word[1].startswith("chart_") else -1
        elif word[0] == "f" and chart >= 0:
            corners = [tuple(int(i) - 1 for i in w.split("/")) for w in word[1:4]]
            faces.append((chart, [positions[c[0]] for c in corners], [uvs[c[1]] for c in corners]))
    return faces


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def camera(faces):
    """Orthographic, from above a corner, the whole model in view: world point -> (x, y, depth) in pixels."""
    points = [p for _, corners, _ in faces for p in corners]
    yaw, pitch = math.radians(35), math.radians(40)
    right = (math.cos(yaw), 0, -math.sin(yaw))
    forward = (-math.sin(yaw) * math.cos(pitch), -math.sin(pitch), -math.cos(yaw) * math.cos(pitch))
    up = (-math.sin(yaw) * math.sin(pitch), math.cos(pitch), -math.cos(yaw) * math.sin(pitch))
    xs, ys = [dot(p, right) for p in points], [dot(p, up) for p in points]
    scale = 0.94 * min(WIDTH / (max(xs) - min(xs)), HEIGHT / (max(ys) - min(ys)))
    cx, cy = (max(xs) + min(xs)) / 2, (max(ys) + min(ys)) / 2
    return lambda p: (WIDTH / 2 + (dot(p, right) - cx) * scale, HEIGHT / 2 - (dot(p, up) - cy) * scale, dot(p, forward))


def tint(chart, light):
    hue = 2 * math.pi * (0.61803398875 * chart % 1)
    return tuple(int(255 * light * (0.7 + 0.3 * math.cos(hue - 2 * math.pi * c / 3))) for c in range(3))


def draw(faces):
    project = camera(faces)
    depth = [math.inf] * (WIDTH * HEIGHT)
    pixels = bytearray(b"\x18" * (3 * WIDTH * HEIGHT))
    for chart, corners, uv in faces:
        (x0, y0, z0), (x1, y1, z1), (x2, y2, z2) = map(project, corners)
        area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
        if area >= 0:  # pixels run down: a front face is clockwise
            continue
        for y in range(max(0, math.floor(min(y0, y1, y2))), min(HEIGHT, math.ceil(max(y0, y1, y2)))):
            for x in range(max(0, math.floor(min(x0, x1, x2))), min(WIDTH, math.ceil(max(x0, x1, x2)))):
                b = ((x + 0.5 - x0) * (y2 - y0) - (x2 - x0) * (y + 0.5 - y0)) / area
                c = ((x1 - x0) * (y + 0.5 - y0) - (x + 0.5 - x0) * (y1 - y0)) / area
                if b < 0 or c < 0 or b + c > 1:
                    continue
                z, at = z0 + b * (z1 - z0) + c * (z2 - z0), y * WIDTH + x
                if z >= depth[at]:
                    continue
                depth[at] = z
                u = uv[0][0] + b * (uv[1][0] - uv[0][0]) + c * (uv[2][0] - uv[0][0])
                v = uv[0][1] + b * (uv[1][1] - uv[0][1]) + c * (uv[2][1] - uv[0][1])
                light = 0.95 if (math.floor(u / CELL) + math.floor(v / CELL)) % 2 else 0.5
                pixels[3 * at:3 * at + 3] = bytes(tint(chart, light))
    return pixels


def write_png(path, pixels):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    rows = b"".join(b"\0" + bytes(pixels[3 * WIDTH * y:3 * WIDTH * (y + 1)]) for y in range(HEIGHT))
    with open(path, "wb") as out:
        out.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", WIDTH, HEIGHT, 8, 2, 0, 0, 0)) +
                  chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b""))


if __name__ == "__main__":
    cut = float(sys.argv[3]) if len(sys.argv) > 3 else math.inf
    write_png(sys.argv[2], draw([f for f in read(sys.argv[1]) if max(p[1] for p in f[1]) <= cut]))
