#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace bakewell {

// One JSON object, its members in the order they are added, printed on one line: what --json gives to other programs.
// Numbers that are not finite become null; text that is not UTF-8 is repaired. Not thread safe.
class JsonLine {
 public:
  JsonLine();
  ~JsonLine();
  JsonLine(const JsonLine& other);
  JsonLine& operator=(const JsonLine& other);

  JsonLine& Add(std::string_view name, std::string_view text);
  JsonLine& Add(std::string_view name, const char* text) { return Add(name, std::string_view(text)); }
  JsonLine& Add(std::string_view name, double number);
  JsonLine& Add(std::string_view name, int64_t number);
  JsonLine& Add(std::string_view name, const std::vector<std::string>& texts);
  JsonLine& Add(std::string_view name, const std::vector<JsonLine>& objects);

  // No line break at the end.
  std::string Text() const;

 private:
  struct Body;
  std::unique_ptr<Body> body_;
};

}  // namespace bakewell
