// Scripts: what somebody could do in the window, as lines of a file, for tests and for figures that can be had again.
//
//     wait first               until a picture of the view as it is now is shown, however coarse
//     wait samples N           until the whole picture has N samples; it gets no more until another `wait`
//     wait error E             until the picture's relMSE is estimated to be below E, from the variance of its samples:
//                              (estimated_relmse() in seen.h)
//     camera NAME              one of the scene's, by name or number
//     animation NAME           that plays, as of --animation; from its frame 0
//     frame N                  of the animation
//     play SECONDS             shows the frames that are due as time goes by, as many as can be made, over and over
//     orbit X Y                a drag of so many pixels, to the right and down
//     pan X Y
//     turn X Y                 of the head
//     dolly FACTOR             distance to what is looked at times so much
//     fly X Y Z                to the right, up, ahead; world units
//     walk X Y Z               the same, ahead on the level
//     focus X Y                looks at what is seen at that pixel
//     key K                    a key: F H R 1 to 9
//     view NAME                final, error, or one of the layers of --aov
//     component NAME on|off    emission, direct_diffuse, direct_glossy, indirect_diffuse or indirect_glossy: whether
//                              the final picture has it; needs no new samples
//     compare on|off           keeps what is seen now as B, to be seen on the right of what is seen later
//     split SHARE              of the window's width that shows the latter, 0 to 1
//     exposure STOPS
//     transform DISPLAY VIEW
//     rotation DEGREES         of the environment
//     intensity FACTOR         of the environment
//     emission FACTOR          of emissive surfaces
//     tint R G B               of the environment, linear, 0 to 1
//     light N FACTOR           of a punctual light, by number
//     light N R G B            its colour, linear, 0 to 1
//     place N X Y Z            puts it there, world units
//     aim N X Y Z              the way its light travels
//     clay on|off
//     bounces N
//     preview LIST             preview modes that are on, as --preview has them: NAME,... or none
//     clamp L                  dims indirect light, a preview mode of the viewer; 0 for none
//     culling NAME             as of --culling
//     measure on|off           times of passes, and counts of what culling does
//     bookmark NAME            keeps the view
//     recall NAME
//     open FILE                a scene or an environment, as if it were dropped, and waits until it is there
//     screenshot FILE          what is seen: .png as it is shown, .exr linear
//     window FILE.png          the whole window, with its panels where they are shown (key H)
//     save                     the settings
//     timings FILE.json        of the pictures since the last such line
//     quit                     so does the end of the file
//
// Words are separated by spaces; "..." keeps some together; # begins a comment.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace halflight::view {

struct Command {
    std::string name;
    std::vector<std::string> words;  // all that follows it
    std::vector<double> numbers;     // those of them that are numbers by the command's nature, finite
    bool on() const { return words.back() == "on"; }
    int line = 0;  // from 1
};

/// Throws Error "FILE:LINE: what" for the first line that is none of the above.
std::vector<Command> parse_script(const std::string& file, std::string_view text);

}  // namespace halflight::view
