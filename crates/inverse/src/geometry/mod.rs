//! From Gaussians and photos to an explicit surface.
