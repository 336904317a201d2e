//! Selecting: clicks, boxes, masks and properties to a set of Gaussians.
