//! Editing: plans of operations on splats and decomposed scenes, and the light that follows them.
