// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/commands/argument_checks.h"
#include "cullet/demos/commands/command_bench.h"
#include "cullet/demos/commands/commands.h"
#include "cullet/demos/commands/scene_arguments.h"
#include "cullet/demos/program/exit_code.h"
#include "cullet/demos/program/files/result_file.h"
#include "cullet/demos/program/interrupt.h"
#include "cullet/demos/program/progress.h"
#include "cullet/demos/render/film/animation.h"
#include "cullet/demos/render/film/recording_film.h"
#include "cullet/demos/render/image/gltf.h"
#include "cullet/demos/render/painter.h"

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <system_error>

namespace cullet
{
namespace
{
struct RenderOptions
{
    SceneArguments scene;
    SceneFilmOptions film;
    std::string recording;  ///< instead of a scene
    std::string size = "960x540";
    int width = 0, height = 0;  ///< `size` in numbers
    std::vector<float> camera;
    float orbit = 0;
    double framesPerSecond = 0;
    std::string folder, animation, gltf;
    std::string json, csv, trace;
    bool quiet = false;
};

void parseSize(RenderOptions& options)
{
    char after = 0;
    const int found = std::sscanf(options.size.c_str(), "%dx%d%c", &options.width, &options.height, &after);
    const auto isFine = [](int pixels) { return pixels >= 16 && pixels <= Painter::kMaxPixels; };
    if (found != 2 || !isFine(options.width) || !isFine(options.height))
        throw std::invalid_argument("--size takes WIDTHxHEIGHT, 16 to 4096 pixels each, not " + options.size);
}

/// A folder for temporary frames; its destructor deletes it.
class TemporaryFolder
{
public:
    TemporaryFolder()
    {
        const std::filesystem::path parent = std::filesystem::temp_directory_path();
        std::random_device random;
        for (int attempt = 0; attempt < 100 && path.empty(); ++attempt)
        {
            const std::filesystem::path folder = parent / ("cullet_frames_" + std::to_string(random()));
            std::error_code error;
            // False if it is there already.
            if (!std::filesystem::create_directory(folder, error))
                continue;
            std::filesystem::permissions(folder, std::filesystem::perms::owner_all, error);
            path = folder.string();
        }
        if (path.empty())
            throw ProgramError(kExitOutput, "cannot make a folder in " + parent.string());
    }
    ~TemporaryFolder()
    {
        std::error_code ignored;
        std::filesystem::remove_all(path, ignored);
    }
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;

    std::string path;
};

/// Reports mistakes before minutes of work.
void checkOutputs(const RenderOptions& options)
{
    const bool wantsPictures = !options.folder.empty() || !options.animation.empty();
    if (!wantsPictures && options.gltf.empty())
        throw std::invalid_argument("say what to write: --out DIR, --animate FILE or --gltf FILE");
    if (!options.gltf.empty())
        checkGltf(options.gltf);
    if (!options.animation.empty())
        checkAnimation(options.animation);
    if (wantsPictures)
        Painter(Film(), options.width, options.height);
    requireWritable(options.gltf);
    requireWritable(options.animation);
    std::error_code failure;
    if (!options.folder.empty() && !std::filesystem::create_directories(options.folder, failure) && failure)
        throw ProgramError(kExitOutput,
                           "cannot make the folder " + options.folder + ": " + failure.message());
}

Film makeFilm(RenderOptions& options)
{
    Progress progress("steps", static_cast<std::uint64_t>(options.film.steps) + 1, options.quiet);
    const auto goOn = [&](int step)
    {
        progress.show(static_cast<std::uint64_t>(step));
        return !isInterrupted();
    };
    options.film.world.dt = btScalar(options.scene.dt);
    if (!options.recording.empty())
        return filmRecording(options.recording, options.film, goOn);
    options.film.scene = options.scene.scene;
    options.film.world = resolveScene(options.scene);
    return filmScene(options.film, goOn);
}

void paintFrames(const RenderOptions& options, const Film& film, const std::string& folder)
{
    CameraOptions cameraOptions = options.camera.empty() ? CameraOptions() : parseCamera(options.camera);
    cameraOptions.orbit = options.orbit;
    Progress progress("frames", film.frames.size(), options.quiet);
    paintFilm(film, options.width, options.height, cameraOptions,
              [&](const Image& image, std::size_t number)
              {
                  writePng(image, framePath(folder, number));
                  progress.show(number + 1);
              });
    // Frames that an earlier, longer film left there would be joined to this film.
    for (std::size_t number = film.frames.size(); std::filesystem::remove(framePath(folder, number));)
        ++number;
}

double frameRate(const RenderOptions& options)
{
    return options.framesPerSecond > 0 ? options.framesPerSecond
                                       : 1 / (options.scene.dt * options.film.every);
}

Json toJson(const RenderOptions& options)
{
    const SceneArguments& scene = options.scene;
    return {{"command", "render"},
            {"scene", scene.scene},
            {"recording", options.recording},
            {"bodies", scene.world.bodies},
            {"steps", options.film.steps},
            {"every", options.film.every},
            {"start", options.film.start},
            {"seed", scene.world.seed},
            {"dt", scene.dt},
            {"backend", scene.world.backend},
            {"narrow", scene.world.narrow},
            {"threads", scene.world.threads},
            {"precision", ownPrecision()},
            {"size", options.size},
            {"camera", options.camera},
            {"orbit", options.orbit},
            {"mesh", scene.meshes},
            {"file", scene.world.file}};
}

/// The row of the film, which is printed too.
Json describeFilm(const RenderOptions& options, const Film& film)
{
    std::printf("%zu frames, %u bodies, %llu pairs at the end, state hash %s; colours: %s\n",
                film.frames.size(), film.bodyCount, static_cast<unsigned long long>(film.source.pairs),
                toHex(film.source.hash).c_str(), describeLegend().c_str());
    const std::string recording = std::filesystem::path(options.recording).filename().string();
    return {
        {"benchmark", "render"},          {"scene", recording.empty() ? options.scene.scene : recording},
        {"backend", film.source.backend}, {"precision", ownPrecision()},
        {"threads", film.source.threads}, {"bodies", film.bodyCount},
        {"pairs", film.source.pairs},     {"hash", toHex(film.source.hash)},
        {"frames", film.frames.size()},   {"seconds", film.frames.empty() ? 0.0 : film.frames.back().time}};
}

int renderCommand(RenderOptions options)
{
    parseSize(options);
    if (!options.camera.empty())
        parseCamera(options.camera);
    requireWorldScene(options.scene.scene);
    checkOutputs(options);
    ResultFile file(toJson(options), options.json, options.csv);
    std::optional<TraceFile> trace;
    options.film.trace = openTrace(trace, options.trace);
    printHead();
    const Film film = makeFilm(options);
    file.addRow(describeFilm(options, film));
    file.save();
    closeTrace(trace);
    if (!options.gltf.empty())
        writeGltf(film, options.gltf);
    if (!options.folder.empty() || !options.animation.empty())
    {
        std::unique_ptr<TemporaryFolder> own;
        if (options.folder.empty())
            own = std::make_unique<TemporaryFolder>();
        const std::string folder = own != nullptr ? own->path : options.folder;
        paintFrames(options, film, folder);
        if (!options.animation.empty())
            joinFrames(folder, frameRate(options), options.animation);
    }
    for (const std::string& path : {options.folder, options.animation, options.gltf})
    {
        if (!path.empty())
            std::printf("wrote %s\n", path.c_str());
    }
    return isInterrupted() ? kExitInterrupted : kExitOk;
}

void addFilmOptions(CLI::App& command, RenderOptions& options)
{
    command.add_option("--recording", options.recording,
                       "draw the boxes of this recording instead of a scene");
    command.add_option("--steps", options.film.steps, "steps of the scene, or frames of the recording")
        ->capture_default_str()
        ->check(CLI::Range(0, 100000000));
    command.add_option("--every", options.film.every, "steps from one frame to the next")
        ->capture_default_str()
        ->check(CLI::Range(1, 1000000));
    command.add_option("--start", options.film.start, "steps before the first frame")
        ->capture_default_str()
        ->check(CLI::Range(0, 100000000));
    command.add_flag("--boxes", options.film.overlay.boxes, "draw the boxes of the broad phase");
    command.add_flag("--cells", options.film.overlay.cells, "draw the cells of its grid");
    command.add_flag("--pairs", options.film.overlay.pairs, "draw a line for each pair");
}

void addPictureOptions(CLI::App& command, RenderOptions& options)
{
    command.add_option("--size", options.size, "of the pictures, pixels")->capture_default_str();
    command
        .add_option("--camera", options.camera,
                    "YAW,PITCH[,ZOOM] in degrees around what moves, or EYE,TARGET as six numbers")
        ->delimiter(',');
    command.add_option("--orbit", options.orbit, "degrees that the camera goes round")
        ->capture_default_str()
        ->check(numberIn(-1e6, 1e6));
    command.add_option("--fps", options.framesPerSecond, "of the animation; default: real time")
        ->check(numberIn(0.1, 1000.0));
    command.add_option("--out", options.folder, "write frames as PNG to this folder");
    command.add_option("--animate", options.animation,
                       "write an animation, .gif or .mp4 (by the program ffmpeg)");
    command.add_option("--gltf", options.gltf, "write bodies and their motion as glTF 2.0, .gltf and .bin");
    command.add_option("--trace", options.trace,
                       "write every phase of every step to this file, for Perfetto");
    command.add_option("--json", options.json, "write what was filmed to this file");
    command.add_option("--csv", options.csv, "write what was filmed to this file");
    command.add_flag("--quiet", options.quiet, "no progress bar");
}
}  // namespace

void addRenderCommand(CLI::App& program, Action& chosen)
{
    CLI::App* command = program.add_subcommand(
        "render", "Draw a scene or a recording to pictures and animations, without a display");
    command->footer(
        "Colours: " + describeLegend() +
        ".\n"
        "Examples:\n"
        "  cullet render --scene drop --bodies 400 --animate drop.gif\n"
        "  cullet render --scene W1 --bodies 3000 --start 4 --steps 4 --cells --pairs --out frames\n"
        "  cullet render --recording drop.cbx --boxes --animate drop.mp4\n"
        "  cullet render --scene drop --bodies 400 --gltf drop.gltf\n");
    const auto options = std::make_shared<RenderOptions>();
    addSceneArguments(*command, options->scene);
    addThreadsArgument(*command, options->scene);
    addPhaseArguments(*command, options->scene);
    addFilmOptions(*command, *options);
    addPictureOptions(*command, *options);
    command->callback([options, &chosen] { chosen = [options] { return renderCommand(*options); }; });
}
}  // namespace cullet
