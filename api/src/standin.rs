//! Stands in for what of the renderer is not there yet.
#![allow(warnings, clippy::all)]
pub mod report {
    use serde_json::{Value, json};
    pub fn plan_json(_s: &nephroid::scene::Scene, p: &nephroid::plan::Plan) -> Value {
        json!({"decisions": p.decisions.iter().map(|d| json!({"topic": d.topic, "runs": d.runs, "choice": d.choice, "reason": d.reason})).collect::<Vec<_>>(),"warnings":[],"memory_bytes":p.memory_bytes})
    }
    pub fn stats_json(r: &nephroid::render::Render) -> Value {
        json!({"rounds": r.rounds()})
    }
}
pub mod image_io {
    use nephroid::image_io::LinearImage;
    use nephroid::scene::ImageSettings;
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
        let rgb = nephroid::develop::develop(i, _s);
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
