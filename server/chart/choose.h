#pragma once

#include <span>
#include <string>
#include <string_view>

#include "core/artifact/settings.h"
#include "core/atlas/layout.h"
#include "core/base/status.h"
#include "core/scene/scene.h"

namespace bakewell {

// Whether the settings ask for the scene's own charts.
bool KeepsCharts(const Scene& scene, const BakeSettings& settings);

// The charts that the settings ask for: the scene's own (KeepCharts) or new ones (GenerateCharts). Errors as theirs.
// Settings' density is not looked at; chart_density: GenerateOptions::chart_density for new charts.
absl::StatusOr<AtlasLayout> ChooseCharts(const Scene& scene, const BakeSettings& settings,
                                         std::span<const float> chart_density = {});

// The same as the task chart/layout (core/artifact/level_task.h): its settings and SerializeScene() bytes in,
// SerializeLayout() bytes out. Safe on hostile bytes.
absl::StatusOr<std::string> RunChartTask(std::string_view task_settings, std::string_view scene_bytes);

}  // namespace bakewell
