// Typed errors. Libraries throw them; only the tools print and choose an exit code.
#pragma once

#include <stdexcept>
#include <string>
#include <vector>

namespace vdbfrac {

/// Base of every error that a user can cause or has to hear of.
class Error : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

/// Bad input: a scene, a mesh, a grid, a command line. Says where, what was found and what is allowed.
class InputError : public Error {
public:
    struct Detail {
        std::string place;    ///< file:line:column, or the file
        std::string what;     ///< the complaint with the offending value
        std::string allowed;  ///< the allowed range or form; may be empty
        std::string hint;     ///< what to do about it; may be empty
    };

    explicit InputError(Detail detail) : InputError(std::vector<Detail>{std::move(detail)}) {}
    /// what() tells the first 20.
    explicit InputError(std::vector<Detail> details);

    const std::vector<Detail>& details() const { return details_; }

private:
    std::vector<Detail> details_;
};

/// A file could not be read or written (missing, full disk, no permission, damaged).
class FileError : public Error {
public:
    FileError(const std::string& file, const std::string& cause) : Error(file + ": " + cause) {}
};

/// A memory or size limit would be passed.
class LimitError : public Error {
public:
    using Error::Error;
};

}  // namespace vdbfrac
