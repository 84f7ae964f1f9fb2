#include "core/artifact/json_line.h"

#include <nlohmann/json.hpp>

namespace bakewell {

using Json = nlohmann::ordered_json;

struct JsonLine::Body {
  Json object = Json::object();
};

JsonLine::JsonLine() : body_(std::make_unique<Body>()) {}
JsonLine::~JsonLine() = default;
JsonLine::JsonLine(const JsonLine& other) : body_(std::make_unique<Body>(*other.body_)) {}

JsonLine& JsonLine::operator=(const JsonLine& other) {
  *body_ = *other.body_;
  return *this;
}

JsonLine& JsonLine::Add(std::string_view name, std::string_view text) {
  body_->object[std::string(name)] = text;
  return *this;
}

JsonLine& JsonLine::Add(std::string_view name, double number) {
  body_->object[std::string(name)] = number;
  return *this;
}

JsonLine& JsonLine::Add(std::string_view name, int64_t number) {
  body_->object[std::string(name)] = number;
  return *this;
}

JsonLine& JsonLine::Add(std::string_view name, const std::vector<std::string>& texts) {
  body_->object[std::string(name)] = texts;
  return *this;
}

JsonLine& JsonLine::Add(std::string_view name, const std::vector<JsonLine>& objects) {
  Json& array = body_->object[std::string(name)] = Json::array();
  for (const JsonLine& line : objects) array.push_back(line.body_->object);
  return *this;
}

std::string JsonLine::Text() const { return body_->object.dump(-1, ' ', false, Json::error_handler_t::replace); }

}  // namespace bakewell
