#pragma once

#include <list>
#include <map>
#include <mutex>

#include "core/artifact/page_preview.h"
#include "core/image/image.h"
#include "server/job/coordinator.h"

namespace bakewell::preview {

// A picture of a page that fills in: the blocks added so far, averaged until the longer side is at most kMaxSide.
class Canvas {
 public:
  static constexpr int kMaxSide = 256;  // pixels
  // kInvalidArgument: of a page of another size.
  absl::Status Add(const PagePreview& part);
  // Tone-mapped, black where nothing is known; kNotFound before anything was added.
  absl::StatusOr<std::string> Png() const;

 private:
  int width_ = 0, height_ = 0;  // of the page, in blocks
  int shrink_ = 1;              // blocks a pixel, along a side
  Image sums_;                  // R G B, and A: how many blocks
};

// Pictures of jobs that run, from what their tasks have left in the store. Each blob is read once, and what is kept is
// a canvas a picture for the few jobs that were asked for last. Thread safe; calls read from disk.
class Pictures {
 public:
  explicit Pictures(job::Coordinator& coordinator) : coordinator_(coordinator) {}
  // The PNG of NAME.png, of those that JobView::previews has. kNotFound: no such picture (yet, or any more).
  absl::StatusOr<std::string> Png(int64_t job, std::string_view name);

 private:
  struct Growing {
    Canvas canvas;
    size_t parts = 0;  // of the job's parts of this picture, in the canvas
  };
  using Key = std::pair<int64_t, std::string>;
  Growing& Find(const Key& key);

  job::Coordinator& coordinator_;
  std::mutex mutex_;
  std::list<std::pair<Key, Growing>> recent_;  // last used first
};

}  // namespace bakewell::preview
