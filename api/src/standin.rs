//! Stands in for the renderer until it is there.
#![allow(warnings, clippy::all)]
pub mod scene {
    pub mod assets {
        use std::borrow::Cow;
        #[derive(Debug)]
        pub enum AssetError {
            NotFound(String),
        }
        pub trait AssetSource: Send + Sync {
            fn read(&self, name: &str) -> Result<Cow<'_, [u8]>, AssetError>;
        }
    }
    #[derive(Debug)]
    pub struct Scene {
        pub name: String,
        pub image: ImageSettings,
        pub render: RenderSettings,
    }
    #[derive(Debug)]
    pub struct RenderSettings {
        pub stop: Stop,
        pub seed: u64,
    }
    #[derive(Debug)]
    pub struct Stop {
        pub seconds: Option<f64>,
        pub rounds: Option<u32>,
    }
    #[derive(Debug, Clone, Copy)]
    pub struct ImageSettings {
        pub width: u32,
        pub height: u32,
    }
    #[derive(Debug)]
    pub struct SceneErrors {
        pub issues: Vec<SceneIssue>,
    }
    #[derive(Debug)]
    pub struct SceneIssue {
        pub pointer: String,
        pub code: IssueCode,
        pub message: String,
        pub line: usize,
        pub column: usize,
    }
    #[derive(Debug)]
    pub struct IssueCode;
    impl IssueCode {
        pub fn as_str(&self) -> &'static str {
            "syntax"
        }
    }
    impl Scene {
        pub fn from_json(text: &str, _a: &dyn assets::AssetSource) -> Result<Self, SceneErrors> {
            let v: serde_json::Value = serde_json::from_str(text).map_err(|e| SceneErrors {
                issues: vec![SceneIssue {
                    pointer: String::new(),
                    code: IssueCode,
                    message: e.to_string(),
                    line: e.line(),
                    column: e.column(),
                }],
            })?;
            for (i, o) in v["objects"].as_array().into_iter().flatten().enumerate() {
                if v["materials"][o["material"].as_str().unwrap_or("")].is_null() {
                    return Err(SceneErrors {
                        issues: vec![SceneIssue {
                            pointer: format!("/objects/{i}/material"),
                            code: IssueCode,
                            message: format!("there is no material {}", o["material"]),
                            line: 12,
                            column: 7,
                        }],
                    });
                }
            }
            let n = |k: &str| v["image"][k].as_u64().unwrap_or(100) as u32;
            let stop = &v["render"]["stop"];
            Ok(Self {
                name: v["name"].as_str().unwrap_or("").into(),
                image: ImageSettings { width: n("width"), height: n("height") },
                render: RenderSettings {
                    seed: 0,
                    stop: Stop {
                        seconds: stop["seconds"].as_f64(),
                        rounds: stop["rounds"].as_u64().map(|n| n as u32),
                    },
                },
            })
        }
    }
}
pub mod light_path {
    #[derive(Debug, Clone, Copy)]
    pub enum PathClass {
        Direct,
        Caustic,
    }
    impl PathClass {
        pub const ALL: [Self; 2] = [Self::Direct, Self::Caustic];
        pub fn name(self) -> &'static str {
            match self {
                Self::Direct => "direct",
                Self::Caustic => "caustic",
            }
        }
    }
}
pub mod plan {
    #[derive(Debug, Clone)]
    pub struct Plan {
        pub memory_bytes: u64,
    }
    impl Plan {
        pub fn new(_s: &super::scene::Scene) -> Self {
            Self { memory_bytes: 1000 }
        }
    }
}
pub mod report {
    use serde_json::{Value, json};
    pub fn plan_json(_p: &super::plan::Plan) -> Value {
        json!({"decisions":[{"topic":"pass 1","runs":true,"choice":"photons","reason":"glass is lit"}],"warnings":[],"memory_bytes":1000})
    }
    pub fn stats_json(_s: &u32) -> Value {
        json!({"photons":{"emitted":1000}})
    }
}
pub mod image_io {
    use super::scene::ImageSettings;
    #[derive(Debug)]
    pub struct LinearImage {
        pub width: u32,
        pub height: u32,
        pub pixels: Vec<[f32; 3]>,
    }
    pub fn encode_exr(_i: &LinearImage) -> Result<Vec<u8>, String> {
        Ok(vec![1, 2, 3])
    }
    fn crc(d: &[u8]) -> u32 {
        let mut c = !0u32;
        for b in d {
            c ^= u32::from(*b);
            for _ in 0..8 {
                c = if c & 1 == 1 { 0xEDB8_8320 ^ (c >> 1) } else { c >> 1 };
            }
        }
        !c
    }
    fn chunk(out: &mut Vec<u8>, kind: &[u8], data: &[u8]) {
        out.extend((data.len() as u32).to_be_bytes());
        let mut d = kind.to_vec();
        d.extend(data);
        out.extend(&d);
        out.extend(crc(&d).to_be_bytes());
    }
    pub fn encode_png(i: &LinearImage, _s: &ImageSettings) -> Result<Vec<u8>, String> {
        let mut raw = vec![];
        for y in 0..i.height as usize {
            raw.push(0);
            for x in 0..i.width as usize {
                for c in i.pixels[y * i.width as usize + x] {
                    raw.push((c.clamp(0., 1.).powf(1. / 2.2) * 255.) as u8);
                }
            }
        }
        let (mut a, mut b) = (1u32, 0u32);
        for x in &raw {
            a = (a + u32::from(*x)) % 65521;
            b = (b + a) % 65521;
        }
        let mut z = vec![0x78, 1];
        let n = raw.chunks(65535).count();
        for (k, c) in raw.chunks(65535).enumerate() {
            z.push(u8::from(k + 1 == n));
            z.extend((c.len() as u16).to_le_bytes());
            z.extend((!(c.len() as u16)).to_le_bytes());
            z.extend(c);
        }
        z.extend(((b << 16) | a).to_be_bytes());
        let mut o = b"\x89PNG\r\n\x1a\n".to_vec();
        let mut h = vec![];
        h.extend(i.width.to_be_bytes());
        h.extend(i.height.to_be_bytes());
        h.extend([8, 2, 0, 0, 0]);
        chunk(&mut o, b"IHDR", &h);
        chunk(&mut o, b"IDAT", &z);
        chunk(&mut o, b"IEND", &[]);
        Ok(o)
    }
}
pub mod render {
    use super::{image_io::LinearImage, light_path::PathClass, plan::Plan, scene::Scene};
    use std::sync::{
        Arc,
        atomic::{AtomicBool, AtomicU32, Ordering},
    };
    #[derive(Debug, Default)]
    pub struct Control {
        cancel: AtomicBool,
        part: AtomicU32,
    }
    impl Control {
        pub fn cancel(&self) {
            self.cancel.store(true, Ordering::SeqCst);
        }
        pub fn round_fraction(&self) -> f32 {
            self.part.load(Ordering::Relaxed) as f32 / 100.
        }
    }
    #[derive(Debug)]
    pub enum RenderError {
        Cancelled,
        NotFinite { x: u32 },
    }
    impl std::fmt::Display for RenderError {
        fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
            write!(f, "{self:?}")
        }
    }
    #[derive(Debug)]
    pub enum StopReason {
        Rounds,
        Seconds,
    }
    impl StopReason {
        pub fn as_str(&self) -> &'static str {
            match self {
                Self::Rounds => "rounds",
                Self::Seconds => "seconds",
            }
        }
    }
    #[derive(Debug)]
    pub struct Render {
        s: Arc<Scene>,
        r: u32,
        t: f64,
        f: Vec<f32>,
    }
    impl Render {
        pub fn new(s: Arc<Scene>, _p: Plan) -> Self {
            let n = (s.image.width * s.image.height) as usize;
            Self { s, r: 0, t: 0., f: vec![0.; n] }
        }
        pub fn resume(s: Arc<Scene>, p: Plan, c: &[u8]) -> Result<Self, String> {
            let mut x = Self::new(s, p);
            let w: Vec<u32> =
                c.chunks(4).map(|b| u32::from_le_bytes(b.try_into().unwrap_or_default())).collect();
            x.r = w[0];
            x.t = f64::from(f32::from_bits(w[1]));
            x.f = w[2..].iter().map(|b| f32::from_bits(*b)).collect();
            Ok(x)
        }
        pub fn checkpoint(&self) -> Vec<u8> {
            [self.r, (self.t as f32).to_bits()]
                .into_iter()
                .chain(self.f.iter().map(|x| x.to_bits()))
                .flat_map(u32::to_le_bytes)
                .collect()
        }
        pub fn run_round(&mut self, c: &Control) -> Result<(), RenderError> {
            let t = std::time::Instant::now();
            let w = self.s.image.width as usize;
            for k in 0..100 {
                std::thread::sleep(std::time::Duration::from_millis(2));
                if c.cancel.load(Ordering::SeqCst) {
                    return Err(RenderError::Cancelled);
                }
                c.part.store(k, Ordering::Relaxed);
            }
            if self.r == 1_000_000 {
                return Err(RenderError::NotFinite { x: 1 });
            }
            for (i, p) in self.f.iter_mut().enumerate() {
                let mut h = (i as u32).wrapping_mul(2_654_435_761) ^ self.r.wrapping_mul(40503);
                h ^= h >> 15;
                h = h.wrapping_mul(0x2c1b_3c6d);
                h ^= h >> 12;
                *p += (h & 0xffff) as f32 / 65536. * (i % w) as f32 / w as f32;
            }
            self.r += 1;
            self.t += t.elapsed().as_secs_f64();
            Ok(())
        }
        pub fn stop_reason(&self) -> Option<StopReason> {
            if self.s.render.stop.rounds.is_some_and(|n| self.r >= n) {
                Some(StopReason::Rounds)
            } else if self.s.render.stop.seconds.is_some_and(|n| self.t >= n) {
                Some(StopReason::Seconds)
            } else {
                None
            }
        }
        pub fn rounds(&self) -> u32 {
            self.r
        }
        pub fn seconds(&self) -> f64 {
            self.t
        }
        pub fn error_estimate(&self) -> Option<f32> {
            (self.r > 0).then(|| 0.3 / (self.r as f32).sqrt())
        }
        pub fn progress(&self) -> f32 {
            let a = self.s.render.stop.rounds.map_or(0., |n| self.r as f32 / n as f32);
            let b = self.s.render.stop.seconds.map_or(0., |n| (self.t / n) as f32);
            a.max(b).min(1.)
        }
        pub fn image(&self) -> LinearImage {
            LinearImage {
                width: self.s.image.width,
                height: self.s.image.height,
                pixels: self
                    .f
                    .iter()
                    .map(|x| {
                        let v = x / self.r.max(1) as f32 * 1.6;
                        [v, v * v + 0.02, v * v * v * 0.8]
                    })
                    .collect(),
            }
        }
        pub fn layer(&self, _c: PathClass) -> LinearImage {
            self.image()
        }
        pub fn stats(&self) -> u32 {
            self.r
        }
    }
}
