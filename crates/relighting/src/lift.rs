//! Views that were relit by other means, lifted back to 3D.
