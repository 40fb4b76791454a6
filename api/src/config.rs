//! Every setting of the service: its flag, its environment variable, its default.

use clap::{Args, Parser, Subcommand};
use std::net::SocketAddr;
use std::path::PathBuf;

/// The command line of `nephroid-api`; without a subcommand it serves.
#[derive(Debug, Parser)]
#[command(name = "nephroid-api", version, about, args_conflicts_with_subcommands = true)]
pub struct Cli {
    /// What to do; `serve` if it is left out.
    #[command(subcommand)]
    pub command: Option<Command>,
    /// The settings of `serve` when the word itself is left out.
    #[command(flatten)]
    pub settings: Settings,
}

/// What the binary can do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Start the service (the default)
    Serve(Box<Settings>),
}

impl Cli {
    /// The settings, whether or not the word `serve` was written.
    #[must_use]
    pub fn into_settings(self) -> Settings {
        match self.command {
            Some(Command::Serve(settings)) => *settings,
            None => self.settings,
        }
    }
}

/// How the service runs.
#[derive(Args, Clone, Debug)]
pub struct Settings {
    /// Address to listen on; port 0 takes a free one and prints it as the first line
    #[arg(long, env = "NEPHROID_LISTEN", default_value = "127.0.0.1:8080")]
    pub listen: SocketAddr,
    /// Folder of the job database and of the pictures; made if it is missing
    #[arg(long, env = "NEPHROID_DATA", default_value = "./nephroid-data")]
    pub data: PathBuf,
    /// Threads that render [default: one per core]
    #[arg(long, env = "NEPHROID_THREADS", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Jobs that may wait; one more is refused with 429
    #[arg(long, env = "NEPHROID_QUEUE", default_value_t = 100)]
    pub queue: u32,
    /// Jobs that share the cores, one round at a time each
    #[arg(long, env = "NEPHROID_CONCURRENT", default_value_t = 4,
          value_parser = clap::value_parser!(u16).range(1..=64))]
    pub concurrent: u16,
    /// Largest request body, in bytes (suffixes k, M, G of 1024)
    #[arg(long, env = "NEPHROID_MAX_BODY", default_value = "32M", value_parser = parse_bytes)]
    pub max_body: usize,
    /// Most pixels of one picture
    #[arg(long, env = "NEPHROID_MAX_PIXELS", default_value_t = 8_294_400)]
    pub max_pixels: u64,
    /// Longest rendering time of one job, in seconds
    #[arg(long, env = "NEPHROID_MAX_SECONDS", default_value_t = 600.0, value_parser = parse_seconds)]
    pub max_seconds: f64,
    /// Most memory that the plan of one job may ask for, in bytes (suffixes k, M, G of 1024)
    #[arg(long, env = "NEPHROID_MAX_MEMORY", default_value = "4G", value_parser = parse_bytes)]
    pub max_memory: usize,
    /// Listen beyond loopback although everyone who can connect may use everything
    #[arg(long, env = "NEPHROID_OPEN")]
    pub open: bool,
}

impl Settings {
    /// Why this address must not be listened on, if it must not.
    #[must_use]
    pub fn refusal(&self) -> Option<String> {
        let refused = !self.listen.ip().is_loopback() && !self.open;
        refused.then(|| {
            format!(
                "{} is not a loopback address: everyone who can reach it could use the service. \
                 Put a proxy with access control in front and listen on loopback, or pass --open.",
                self.listen
            )
        })
    }
}

fn parse_bytes(text: &str) -> Result<usize, String> {
    let (digits, shift) = match text.char_indices().last() {
        Some((at, 'k' | 'K')) => (&text[..at], 10),
        Some((at, 'm' | 'M')) => (&text[..at], 20),
        Some((at, 'g' | 'G')) => (&text[..at], 30),
        _ => (text, 0),
    };
    let number: usize = digits.parse().map_err(|_| format!("{text:?} is not a size such as 500k or 32M"))?;
    number.checked_mul(1 << shift).ok_or_else(|| format!("{text} is too large"))
}

fn parse_seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if seconds.is_finite() && seconds > 0.0 => Ok(seconds),
        _ => Err(format!("{text:?} is not a positive number of seconds")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(arguments: &[&str]) -> Settings {
        let arguments = std::iter::once("nephroid-api").chain(arguments.iter().copied());
        Cli::try_parse_from(arguments).unwrap().into_settings()
    }

    #[test]
    fn the_word_serve_may_be_left_out() {
        for prefix in [&[][..], &["serve"][..]] {
            let arguments = [prefix, &["--listen", "127.0.0.1:0", "--max-body", "1M"]].concat();
            let settings = settings(&arguments);
            assert_eq!(settings.listen.port(), 0);
            assert_eq!(settings.max_body, 1 << 20);
        }
    }

    #[test]
    fn an_address_beyond_loopback_needs_open() {
        assert!(settings(&["--listen", "0.0.0.0:80"]).refusal().is_some());
        assert!(settings(&["--listen", "0.0.0.0:80", "--open"]).refusal().is_none());
        assert!(settings(&["--listen", "[::1]:80"]).refusal().is_none());
    }

    #[test]
    fn sizes_have_binary_suffixes() {
        assert_eq!(parse_bytes("3k"), Ok(3072));
        assert_eq!(parse_bytes("77"), Ok(77));
        assert!(parse_bytes("").is_err());
        assert!(parse_bytes("99999999999G").is_err());
    }
}
