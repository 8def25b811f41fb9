#include "client/options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <sstream>

#include "client/printable.h"
#include "client/server_address.h"

namespace volsmooth {
namespace {

/// Turns a parser of ours into an option's value; what it refuses is a usage error under the option's name.
template <typename Parse, typename Take>
CLI::Option* add_parsed(CLI::App& app, const std::string& name, const std::string& help, Parse parse,
                        Take take) {
  return app.add_option_function<std::string>(
      name,
      [=](const std::string& text) {
        auto value = parse(text);
        if (!value) throw CLI::ValidationError(name, value.error());
        take(std::move(*value));
      },
      help);
}

void add_list(CLI::App& app, const std::string& name, std::vector<std::string>& values,
              const std::string& help, const std::vector<std::string>& allowed = {}) {
  auto* option = app.add_option(name, values, help)->delimiter(',')->allow_extra_args(false);
  if (!allowed.empty()) option->check(CLI::IsMember(allowed));
}

Parsed<std::string> utf8_text(const std::string& text) {
  try {
    nlohmann::json(text).dump();
  } catch (const nlohmann::json::exception&) {
    return tl::unexpected(std::string("the text is not UTF-8"));
  }
  return text;
}

void set_once(nlohmann::json& parameters, const std::string& name, nlohmann::json value) {
  if (parameters.contains(name)) throw CLI::ValidationError("--set", in_quotes(name) + " is given twice");
  parameters[name] = std::move(value);
}

void add_common_options(CLI::App& app, Options& options) {
  app.add_option("--server", options.server,
                 "Where volsmoothd listens: http://host:port or unix:/path (or VOLSMOOTH_SERVER; default " +
                     std::string(kDefaultServer) + ", and for smooth a private one)")
      ->envname("VOLSMOOTH_SERVER");
  app.add_option("--token-file", options.token_file,
                 "File with the access token (or the token in VOLSMOOTH_TOKEN)");
  app.add_flag("--plain-token", options.plain_token, "Send the token without TLS, also to another machine");
  app.add_option("--ca-file", options.ca_file,
                 "Certificates (PEM) that an https server is trusted by, in place of the system's (or "
                 "VOLSMOOTH_CA_FILE)")
      ->envname("VOLSMOOTH_CA_FILE");
  app.add_flag("--json", options.json, "Print the documents of the REST interface, one a line");
  app.add_flag("-q,--quiet", options.quiet, "No progress, no warnings");
  app.add_flag("-v,--verbose", options.verbose, "Tell each request, and what the private daemon logs");
  app.set_version_flag("--version", "volsmooth " VOLSMOOTH_VERSION);
}

void add_order_options(CLI::App& app, OrderOptions& order) {
  app.add_option("--method", order.method, "What to do; see volsmooth methods")->capture_default_str();
  const auto set_number = [&order](const char* name) {
    return [&order, name](double value) { set_once(order.parameters, name, value); };
  };
  auto* radius = add_parsed(app, "--feature-radius", "Balls of a smaller radius vanish, such as 2mm",
                            parse_length_mm, set_number("feature_radius_mm"));
  add_parsed(app, "--flow-time", "The strength as a flow time, such as 1mm2: the radius squared, over 4",
             parse_flow_time_mm2, set_number("flow_time_mm2"))
      ->excludes(radius);
  add_parsed(app, "--isovalue",
             "Surfaces at these values of the volume (40,90), at one found for you (auto), or none",
             parse_isovalues, [&order](Isovalues values) { order.isovalues = std::move(values); });
  add_list(app, "--mesh", order.mesh_formats, "Formats of the surfaces: stl, ply, obj, glb",
           {"stl", "ply", "obj", "glb"});
  app.add_option("--mesh-frame", order.mesh_frame,
                 "World frame of the surfaces: RAS or LPS; default: the volume's own")
      ->check(CLI::IsMember({"RAS", "LPS"}));
  app.add_option("--voxel-type", order.voxel_type,
                 "Voxels of the smoothed volume: same (as the input's) or float32")
      ->check(CLI::IsMember({"same", "float32"}));
  add_list(app, "--outputs", order.outputs,
           "Files of the smoothed volume: nifti; of a DICOM input also dicom-series, dicom-stl, dicom-obj, "
           "dicom-surface-segmentation");
  app.add_option_function<std::vector<std::string>>(
         "--set",
         [&order](const std::vector<std::string>& settings) {
           for (const std::string& text : settings) {
             auto setting = parse_setting(text);
             if (!setting) throw CLI::ValidationError("--set", setting.error());
             set_once(order.parameters, setting->first, setting->second);
           }
         },
         "A parameter of the method, as name=value; may be repeated")
      ->allow_extra_args(false);
  add_parsed(app, "--label", "Text of yours that the job keeps", utf8_text,
             [&order](std::string text) { order.label = std::move(text); });
  app.footer("Each method's parameters with their units, limits and defaults: volsmooth methods");
}

/// An option that goes into a request's query as it was written.
CLI::Option* add_query(CLI::App& app, Options& options, const std::string& option, const std::string& name,
                       const std::string& help) {
  return app.add_option_function<std::string>(
      option, [&options, name](const std::string& value) { options.query.emplace_back(name, value); }, help);
}

void add_upload_options(CLI::App& app, Options& options) {
  add_query(app, options, "--volume-index", "volume_index", "Which volume of a 4-D file, from 0")
      ->check(CLI::NonNegativeNumber);
  add_query(app, options, "--series", "series", "Which of several DICOM series, by UID");
  add_query(app, options, "--resample", "resample", "uniform: interpolate uneven DICOM slices to even ones")
      ->check(CLI::IsMember({"uniform"}));
  add_query(app, options, "--non-finite", "non_finite", "Value that replaces NaN and infinities")
      ->check(CLI::Number);
}

void add_output_options(CLI::App& app, Options& options) {
  app.add_option("-o,--output", options.output_folder, "Folder for the results; made if missing")->required();
  app.add_flag("--force", options.force, "Replace files that exist");
}

void add_smooth(CLI::App& app, Options& options) {
  auto& smooth = *app.add_subcommand("smooth", "Smooth volumes and write the results into a folder");
  smooth
      .add_option("INPUT", options.inputs,
                  "NIfTI files; DICOM: a folder, a zip or a multi-frame file for each volume")
      ->required();
  add_output_options(smooth, options);
  add_order_options(smooth, options.order);
  add_upload_options(smooth, options);
}

void add_volume_commands(CLI::App& app, Options& options) {
  auto& upload = *app.add_subcommand("upload", "Send a volume to the server; prints its id");
  upload.add_option("FILE", options.inputs, "NIfTI file; DICOM: a folder, a zip or a multi-frame file")
      ->required()
      ->expected(1);
  add_upload_options(upload, options);
  auto& volumes = *app.add_subcommand("volumes", "List the volumes on the server, newest first");
  add_query(volumes, options, "--limit", "limit", "At most so many")->check(CLI::PositiveNumber);
  add_query(volumes, options, "--cursor", "cursor", "Go on where an earlier list ended");
}

void add_job_commands(CLI::App& app, Options& options) {
  auto& submit = *app.add_subcommand("submit", "Start a job on a volume of the server; prints its id");
  submit.add_option("--volume", options.id, "The volume's id")->required();
  add_order_options(submit, options.order);

  auto& jobs = *app.add_subcommand("jobs", "List the jobs on the server, newest first");
  add_query(jobs, options, "--state", "state", "Only those queued, running, succeeded, failed or cancelled");
  add_query(jobs, options, "--method", "method", "Only those of this method");
  add_query(jobs, options, "--label", "label", "Only those with this label");
  add_query(jobs, options, "--limit", "limit", "At most so many")->check(CLI::PositiveNumber);
  add_query(jobs, options, "--cursor", "cursor", "Go on where an earlier list ended");

  struct IdCommand {
    const char *name, *help, *id_help;
  };
  for (const IdCommand& row :
       {IdCommand{"show", "Show a job or a volume", "Id of a job or volume"},
        IdCommand{"wait", "Wait until a job has ended", "Id of a job"},
        IdCommand{"cancel", "Cancel a job", "Id of a job"},
        IdCommand{"fetch", "Write a job's results into a folder", "Id of a job"},
        IdCommand{"delete", "Delete a job with its results, or a volume", "Id of a job or volume"}}) {
    auto& command = *app.add_subcommand(row.name, row.help);
    command.add_option("ID", options.id, row.id_help)->required();
  }
  auto& fetch = *app.get_subcommand("fetch");
  add_output_options(fetch, options);
  fetch.add_option("--stem", options.stem, "What the files' names begin with");

  app.add_subcommand("methods", "List the methods with their parameters, units, limits and defaults");
}

}  // namespace

tl::expected<Options, NoCommand> parse_command_line(std::vector<std::string> arguments) {
  Options options;
  CLI::App app("Smooths medical volumes: every isosurface at once, by mean curvature flow and more.",
               "volsmooth");
  app.fallthrough();
  app.require_subcommand(1, 1);
  app.failure_message([](const CLI::App*, const CLI::Error& error) {
    return "volsmooth: " + std::string(error.what()) + "\nvolsmooth --help tells more.\n";
  });
  add_common_options(app, options);
  add_smooth(app, options);
  add_volume_commands(app, options);
  add_job_commands(app, options);
  app.footer("volsmooth smooth head.nii.gz -o out --feature-radius 2mm --isovalue 40,90 --mesh stl,glb");

  try {
    std::ranges::reverse(arguments);  // CLI11 takes them from the back
    app.parse(std::move(arguments));
  } catch (const CLI::ParseError& end) {
    std::ostringstream text;
    const int code = app.exit(end, text, text);
    return tl::unexpected(NoCommand{code == 0 ? ExitCode::kDone : ExitCode::kUsage, text.str()});
  }
  options.command = app.get_subcommands().front()->get_name();
  return options;
}

nlohmann::json order_document(const OrderOptions& order, const std::string& volume) {
  nlohmann::json isovalues = "auto";
  if (!order.isovalues.automatic) {
    isovalues = nlohmann::json::array();
    for (const Isovalue& isovalue : order.isovalues.values) isovalues.push_back(isovalue.value);
  }
  nlohmann::json document = {{"volume", volume},
                             {"method", order.method},
                             {"parameters", order.parameters},
                             {"isovalues", std::move(isovalues)},
                             {"mesh_formats", order.mesh_formats},
                             {"outputs", order.outputs}};
  const std::pair<const char*, const std::string&> optional[] = {
      {"mesh_frame", order.mesh_frame}, {"voxel_type", order.voxel_type}, {"label", order.label}};
  for (const auto& [name, value] : optional) {
    if (!value.empty()) document[name] = value;
  }
  return document;
}

}  // namespace volsmooth
