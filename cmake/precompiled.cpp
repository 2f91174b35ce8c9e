// Nothing: the target that compiles precompiled.hpp must have a source (Precompiled.cmake).
