#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/atlas/layout.h"
#include "core/base/sha256.h"
#include "core/base/status.h"
#include "core/scene/scene.h"

namespace bakewell {

// What was found in one primitive that a bake has to survive. Only objects with something to say are listed.
struct ObjectReport {
  std::string object;       // as messages name it
  int64_t triangles = 0;    // of the source, bad ones included
  int64_t non_finite = 0;   // triangles with a NaN, an infinity or a coordinate beyond 10^9 m
  int64_t degenerate = 0;   // triangles without area in float precision
  int64_t duplicate = 0;    // triangles that another one of the object repeats, same corners, same front
  int64_t bad_normals = 0;  // vertices whose NORMAL has no direction: the geometric one is used
  int64_t bad_uvs = 0;      // texture coordinates that are not finite: zero is used
  bool lacks_uv0 = false;   // although its material has a texture there
  bool lacks_uv1 = false;   // although it is lightmapped
};

// A level as LoadLevel gives it: canonical scene, and what a person should read.
struct LoadedLevel {
  Scene scene;
  std::vector<std::string> warnings;  // one a line, each said once
  std::vector<ObjectReport> geometry;
  Digest file_digest;  // of the .gltf or .glb, so that WriteLevel notices another file
};

// What a file may ask for. Beyond it: kInvalidArgument.
struct LoadLimits {
  int64_t max_vertices = int64_t{1} << 26;      // of all objects together, instances expanded
  int64_t max_triangles = int64_t{1} << 26;     // likewise
  int64_t max_image_pixels = int64_t{1} << 26;  // of one image
  int64_t max_total_pixels = int64_t{1} << 28;  // of all images
};

// Reads a glTF 2.0 level (.gltf or .glb; README.md lists what is understood) into a canonical Scene. Safe on hostile
// files. A bad triangle keeps its place in Object::index but becomes {a, a, a} with a finite corner a.
// kNotFound: a file is missing. kInvalidArgument: everything else, "file: object: reason".
absl::StatusOr<LoadedLevel> LoadLevel(const std::filesystem::path& path, const LoadLimits& limits = {});

// The files of one page, as written into scene.glb: paths relative to it. Empty: not mentioned.
struct LightmapFiles {
  std::string irradiance, sh, variance;
};

// Writes the level again as a .glb with the layout's TEXCOORD_1 and, per lightmapped node, extras.lightmap
// {page, texCoord, irradiance, sh, variance} (README.md: "What is written"). Everything else in the file is kept.
// `level` must be what LoadLevel(path_in) gave; `layout` has one entry per object of it; files has one entry per page.
// The output appears whole or not at all. kFailedPrecondition: path_in has changed since. kUnavailable: the disk.
absl::Status WriteLevel(const std::filesystem::path& path_in, const LoadedLevel& level, const AtlasLayout& layout,
                        std::span<const LightmapFiles> files, const std::filesystem::path& path_out);

}  // namespace bakewell
