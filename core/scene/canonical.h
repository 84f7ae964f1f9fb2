#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/base/sha256.h"
#include "core/base/status.h"
#include "core/scene/scene.h"

namespace bakewell {

// Sorts objects and lights by the digest of their content, and numbers materials and textures by first use (unused ones
// are dropped, equal ones become one), so that the order of a file's nodes and meshes changes nothing that is baked.
// Names and sources do not count as content; equal objects keep their relative order.
void Canonicalize(Scene& scene);

// The scene's bytes, format "BWSC" version 1 (schema/scene.md). Names and sources are part of it, behind the content.
std::vector<std::byte> SerializeScene(const Scene& scene);

// Safe on hostile bytes. kDataLoss for a truncated or malformed blob, kFailedPrecondition for another version.
absl::StatusOr<Scene> ParseScene(std::span<const std::byte> bytes);

// SHA-256 of what a bake depends on: SerializeScene without names and sources.
Digest SceneDigest(const Scene& scene);

}  // namespace bakewell
