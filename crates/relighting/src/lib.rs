//! Relighting: a decomposed scene under another light, as views, as baked colours, as a scene.
