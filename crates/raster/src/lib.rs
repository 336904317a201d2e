//! motes-raster
