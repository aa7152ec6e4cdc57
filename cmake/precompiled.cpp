// So that the precompiled headers belong to something.
