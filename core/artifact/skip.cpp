#include "core/artifact/skip.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include <algorithm>

#include "core/base/fields.h"

namespace bakewell {

SkipSet SkipSet::All() {
  SkipSet set;
  for (size_t i = 0; i < kSkipNames.size(); ++i) set.Add(static_cast<Skip>(i));
  return set;
}

absl::StatusOr<SkipSet> SkipSetOf(std::span<const std::string> names) {
  SkipSet set;
  for (const std::string& name : names) {
    if (name == "all") return SkipSet::All();
    const auto found =
        std::find_if(kSkipNames.begin(), kSkipNames.end(), [&](const char* kind) { return name == kind; });
    if (found == kSkipNames.end()) {
      return absl::InvalidArgumentError(
          absl::StrCat("nothing to skip is called '", name, "': all, ", absl::StrJoin(kSkipNames, ", ")));
    }
    set.Add(static_cast<Skip>(found - kSkipNames.begin()));
  }
  return set;
}

void SkipTally::Add(const SkipTally& other) {
  for (size_t i = 0; i < kind.size(); ++i) kind[i].Add(other.kind[i]);
  audited += other.audited;
  failed_over += other.failed_over;
  found_ppm = std::max(found_ppm, other.found_ppm);
}

std::string Serialize(const SkipTally& tally) {
  FieldWriter writer;
  for (const SkipCount& count : tally.kind) {
    for (const int64_t value : {count.skipped, count.of, count.saved}) writer.Put(static_cast<uint64_t>(value));
  }
  for (const int64_t value : {tally.audited, tally.failed_over, tally.found_ppm}) {
    writer.Put(static_cast<uint64_t>(value));
  }
  return std::move(writer).bytes();
}

absl::StatusOr<SkipTally> ParseSkipTally(std::string_view bytes) {
  FieldReader reader(bytes);
  SkipTally tally;
  for (SkipCount& count : tally.kind) {
    for (int64_t* value : {&count.skipped, &count.of, &count.saved})
      *value = static_cast<int64_t>(reader.Get<uint64_t>());
  }
  for (int64_t* value : {&tally.audited, &tally.failed_over, &tally.found_ppm}) {
    *value = static_cast<int64_t>(reader.Get<uint64_t>());
  }
  BAKEWELL_RETURN_IF_ERROR(reader.Finish("skip tally"));
  return tally;
}

}  // namespace bakewell
