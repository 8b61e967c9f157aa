// Scripts: the actions of a user as lines of a file, for tests and for reproducible figures.
//
//     wait first               waits until a picture of the current view is shown, at any resolution
//     wait samples N           waits until the picture has N samples, and pauses it until the next `wait`
//     wait error E             waits until the relMSE of the picture is below E: against the picture of `reference`,
//     else
//                              estimated (layer_view.h)
//     reference FILE.exr       measures errors against a picture of the same size and view
//     camera NAME              a camera of the scene, by name or number
//     animation NAME           animation to play, as for --animation; starts at frame 0
//     frame N                  frame of the animation
//     play SECONDS             plays in real time in a loop; late frames are skipped
//     orbit X Y                drag to the right and down, pixels
//     pan X Y                  drag to the right and down, pixels
//     turn X Y                 drag to the right and down, pixels; rotates the camera
//     dolly FACTOR             factor on the distance to the camera's target
//     fly X Y Z                moves to the right, up and ahead, world units
//     walk X Y Z               moves to the right, up and ahead, world units; X and Z are horizontal
//     focus X Y                aims at the surface at that pixel
//     lens X Y                 focuses the lens on the surface at that pixel: depth of field
//     fstop N                  f-number of the lens
//     key K                    a key of the table of actions (actions.h), such as F, F1 or Ctrl+S
//     view NAME                layer: final, error, or one of --aov; give `wait first` before saving it
//     component NAME on|off    component of the final picture, such as direct_diffuse; needs no new samples
//     compare on|off           keeps the current picture as B, shown to the right of the live picture
//     against FILE             takes the picture of an .exr or a .png as B
//     comparison MODE          split, difference or flicker
//     split SHARE              share of the window's width that shows the live picture, 0 to 1
//     exposure STOPS           exposure, stops
//     transform DISPLAY VIEW   view transform
//     rotation DEGREES         rotation of the environment
//     intensity FACTOR         factor on the environment
//     emission FACTOR          factor on emissive surfaces
//     tint R G B               colour factor on the environment, linear, 0 to 1
//     light NAME=KEY:VALUE,... edits lights, as --light does
//     material NAME.PROPERTY=VALUE  edits materials, as --material does
//     node NAME=KEY:VALUE,...  moves nodes, as --node does
//     environment VALUE        environment, as --env takes it: a file, a colour, a preset, none
//     variant NAME             material variant; "" for the file's own materials
//     undo, redo               takes back the last edit, repeats it
//     select OBJECT            selects node:NAME, light:NAME, material:NAME, mesh:NAME, camera:NAME, environment, none
//     click X Y                selects the node of the surface at that pixel
//     search TEXT              shows objects whose names contain the text in the list; "" for all
//     handles NAME             handles of the selected object: move, rotate, scale or none
//     drag X Y X Y             drags the nearest handle from the first pixel to the second
//     hide NAME                hides nodes, meshes and lights, as --hide does
//     show NAME                shows what `hide` of the same name has hidden
//     light N FACTOR           factor on a punctual light, by number
//     light N R G B            colour of a punctual light, linear, 0 to 1
//     place N X Y Z            position of a punctual light, world units
//     aim N X Y Z              direction of a punctual light
//     clay on|off              grey diffuse material for the whole scene
//     bounces N                maximum number of bounces
//     preview LIST             preview modes, as for --preview: NAME,... or none
//     denoise NAME             off, preview or always
//     clamp L                  maximum luminance of a sample of indirect light, biased; 0 for none
//     backfaces NAME           as for --backfaces
//     lamps on|off             as for --show-lamps
//     culling NAME             as for --culling
//     section NAME             section of the side bar
//     measure on|off           pass times and culling counters
//     bookmark NAME            stores the camera
//     recall NAME              restores the camera
//     open FILE                opens a scene or an environment and waits until it is loaded
//     reload                   waits until files have changed on disk, and loads them (--watch)
//     screenshot FILE          the picture: .png as displayed, .exr linear
//     window FILE.png          the whole window, including panels if they are shown (key H)
//     save                     saves the settings
//     region X0 Y0 X1 Y1       gives further samples only to the pixels from X0,Y0 to before X1,Y1
//     region off               gives samples to the whole picture again
//     probe X Y FILE.json      what is known about a pixel
//     histogram FILE.json      distribution of luminance
//     input SECONDS            takes real input of mouse and keys for that time
//     input until FILE         takes real input until a file exists
//     state FILE.json          layer, exposure, selection, camera, bookmarks, samples, views so far
//     timings FILE.json        timings of the pictures since the last `timings`
//     quit                     ends the viewer, like the end of the file
//
// Words are separated by spaces; "..." encloses a word with spaces; # starts a comment.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace halflight::view {

struct Command {
    std::string name;
    std::vector<std::string> words;  // words after the command's name
    std::vector<double> numbers;     // values of the words that the command takes as numbers, finite
    bool on() const { return words.back() == "on"; }
    int line = 0;  // line of the file, >= 1
};

/// Parses a script. Throws Error "FILE:LINE: what" for the first invalid line.
std::vector<Command> parse_script(const std::string& file, std::string_view text);

}  // namespace halflight::view
