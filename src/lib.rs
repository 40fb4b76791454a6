//! Nephroid: caustics by two-pass photon mapping.
//!
//! The nephroid is the bright curve on the bottom of a coffee cup. Pass 1 traces photons forward from the
//! lights through mirrors and glass into a kd-tree; pass 2 traces rays backward from the eye and looks the
//! photons up.
//!
//! # Light paths
//!
//! L is the light, D a surface a photon may rest on, S a mirror or smooth glass, E the eye. Every path of light
//! matches `L(D|S)*E`. Four disjoint classes, each computed by one estimator and in a layer of its own:
//!
//! | class | paths | estimator |
//! |---|---|---|
//! | emitted | `LS*E` | pass 2: the eye's specular path meets a light |
//! | direct | `LDS*E` | pass 2: shadow rays to the lights at the first D |
//! | caustic | `LS+DS*E` | pass 1 stores photons, pass 2 estimates their density at the first D |
//! | indirect | `L(D\|S)*DS*DS*E` | pass 2 goes on from each D, if the scene asks for it |
//!
//! # The way of the data
//!
//! A scene file ([`scene::Scene::from_json`]) is compiled to flat arrays; the [`plan`] decides what the scene
//! needs; a [`render::Render`] makes rounds, each a pure function of scene, plan and number, and adds them to
//! the [`film`] until the estimated error, the time or the rounds asked for are reached.
//!
//! ```
//! use nephroid::{plan::Plan, render::{Control, Render}, scene::{NoAssets, Scene}};
//! use std::sync::Arc;
//!
//! let text = r#"{ "nephroid": 1,
//!   "image": { "width": 32, "height": 24 },
//!   "camera": { "type": "perspective", "eye": [0, 2.4, 4.2], "target": [0, 0.2, 0], "fov": 36 },
//!   "materials": { "floor": { "type": "diffuse", "albedo": [0.7, 0.7, 0.7] },
//!                  "glass": { "type": "glass", "ior": 1.5 } },
//!   "objects": [
//!     { "type": "polygon", "vertices": [[-3,0,3], [3,0,3], [3,0,-3], [-3,0,-3]], "material": "floor" },
//!     { "type": "sphere", "center": [0, 0.55, 0], "radius": 0.5, "material": "glass" } ],
//!   "lights": [{ "type": "point", "position": [1, 3, 1], "intensity": [5, 5, 5] }],
//!   "render": { "stop": { "rounds": 2 } } }"#;
//! let scene = Arc::new(Scene::from_json(text, &NoAssets)?);
//! let mut render = Render::new(Arc::clone(&scene), Plan::new(&scene));
//! let control = Control::new();
//! while render.stop_reason().is_none() {
//!     render.run_round(&control)?;
//! }
//! assert_eq!(render.image().pixels.len(), 32 * 24);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Modules, in reading order
//!
//! [`light_path`] the notation · [`scene`] file and compiled scene · [`geometry`] rays and surfaces · [`optics`]
//! mirror and glass · [`media`] what a ray is inside of · [`spectrum`] wavelengths · [`bsdf`] scattering · [`sampling`] random and low-discrepancy numbers · [`plan`] what runs and why · [`render`] the
//! method on one screen · [`pass1_light`] `LS+D` · [`photon_map`] the kd-tree · [`radius`] how wide to look ·
//! [`pass2_eye`] `…E` · [`film`] layers and their error · [`develop`], [`image_io`] pictures · [`import`] models in glTF · [`compare`]
//! how two differ · [`lab`] error against time, charted · [`report`] plans and statistics as JSON.

pub mod bsdf;
pub mod compare;
pub mod develop;
pub mod effort;
pub mod film;
pub mod geometry;
pub mod image_io;
pub mod import;
pub mod lab;
pub mod light_path;
pub mod media;
pub mod optics;
pub mod pass1_light;
pub mod pass2_eye;
pub mod photon_map;
pub mod picture;
pub mod plan;
pub mod radius;
pub mod render;
pub mod report;
pub mod sampling;
pub mod scene;
pub mod smooth;
pub mod spectrum;
