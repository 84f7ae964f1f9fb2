#include "client/cli/cli.h"

#include "client/cli/admin_command.h"
#include "client/cli/commands.h"
#include "client/cli/farm_commands.h"
#include "client/cli/interrupt.h"
#include "core/artifact/json_line.h"
#include "core/artifact/manifest.h"

namespace bakewell {
namespace {

constexpr int kExitFailed = 1;
constexpr int kExitUserError = 2;

int ExitCode(absl::StatusCode code) {
  switch (code) {
    case absl::StatusCode::kOk:
      return 0;
    case absl::StatusCode::kCancelled:
      return kExitCancelled;
    case absl::StatusCode::kInvalidArgument:
    case absl::StatusCode::kNotFound:
    case absl::StatusCode::kOutOfRange:
    case absl::StatusCode::kFailedPrecondition:
      return kExitUserError;
    default:
      return kExitFailed;
  }
}

bool HasCommand(CLI::App& app, const std::string& name) {
  return !app.get_subcommands([&](const CLI::App* command) { return command->get_name() == name; }).empty();
}

}  // namespace

int ReportError(const absl::Status& status, OutputForm form, const Console& console) {
  const std::string message(status.message());
  if (form == OutputForm::kJson) {
    JsonLine line;
    line.Add("event", "error").Add("code", absl::StatusCodeToString(status.code())).Add("message", message);
    console.out << line.Text() << std::endl;
  } else {
    console.err << "bakewell: " << message << std::endl;
  }
  return ExitCode(status.code());
}

int RunCli(int argc, const char* const* argv, const Console& console, const Bakers& bakers) {
  CLI::App app("bakewell bakes the lighting of game levels into lightmaps.", "bakewell");
  app.set_version_flag("--version", ProgramVersion());
  app.require_subcommand(1);
  int exit_code = 0;
  AddBakeCommand(app, console, bakers, &exit_code);
  AddReferenceCommand(app, console, bakers, &exit_code);
  AddCompareCommand(app, console, &exit_code);
  AddUnwrapCommand(app, console, bakers, &exit_code);
  AddFarmCommands(app, console, &exit_code);
  AddAdminCommand(app, console, &exit_code);
  if (argc > 1 && argv[1][0] != '-' && !HasCommand(app, argv[1])) {
    console.err << "bakewell: there is no command " << argv[1] << "; bakewell --help lists them" << std::endl;
    return kExitUserError;
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error, console.out, console.err) == 0 ? 0 : kExitUserError;
  }
  return exit_code;
}

}  // namespace bakewell
