#include <vdbfrac/lab/machine/scratch.h>

#include <vdbfrac/base/error.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string>

namespace vdbfrac::lab {

ScratchFolder::ScratchFolder()
{
    std::error_code error;
    const std::filesystem::path parent = std::filesystem::temp_directory_path(error);
    if (error) throw FileError("the folder for temporary files", error.message() + "; set TMPDIR");
    std::string name = (parent / "vdbfrac-XXXXXX").string();
    if (!mkdtemp(name.data())) throw FileError(name, std::string("cannot be made: ") + std::strerror(errno));
    path_ = name;
}

ScratchFolder::~ScratchFolder()
{
    std::error_code ignored;  // what is left over is temporary anyway
    std::filesystem::remove_all(path_, ignored);
}

}  // namespace vdbfrac::lab
