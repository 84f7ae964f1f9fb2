#pragma once

#include <initializer_list>
#include <nlohmann/json.hpp>
#include <string>

#include "core/base/status.h"

namespace bakewell::gltf {

// Checks the shape of every part of a glTF document that bakewell reads: types, array lengths, required members,
// ranges, and that each index names an element that exists. After it the readers need no test of their own for these.
// kInvalidArgument naming the object ("nodes[3] \"lamp\"") and the member.
absl::Status CheckSchema(const nlohmann::json& document);

// The member at the end of a path of member names, or null where it is absent or something on the way is not an object.
const nlohmann::json* Find(const nlohmann::json& value, std::initializer_list<const char*> path);
double NumberOr(const nlohmann::json& value, std::initializer_list<const char*> path, double otherwise);
std::string StringOr(const nlohmann::json& value, std::initializer_list<const char*> path, const char* otherwise);

// How messages name an element of a top-level array: nodes[3] "lamp".
std::string NameOf(const nlohmann::json& document, const std::string& array, int index);

}  // namespace bakewell::gltf
