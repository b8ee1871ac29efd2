// Lists of frames, and the names of files in sequences.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace vdbfrac::cli {

/// Frames of a text as 1-96, 1-96x2 (every second), 5,9,12, or several of these with commas. In the order given.
/// Throws InputError.
std::vector<int> parseFrames(const std::string& text);

/// A frame of a text that is nothing but its digits; none of anything else, also of what no int can hold.
std::optional<int> parseFrame(std::string_view text);

/// Has a name a place for the frame: ####, $F, $F4, %d or %04d?
bool isSequence(const std::string& name);

/// The name with each such place filled: as many digits as there are # or as the number says, more when needed.
std::string frameName(const std::string& name, int frame);

/// Makes the folder that a file of a sequence goes into, if it is not there. Throws FileError.
void makeFolderOf(const std::filesystem::path& file);

}  // namespace vdbfrac::cli
