// The translation unit that owns the precompiled headers (cmake/Precompiled.cmake).
