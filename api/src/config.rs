//! Every setting of the service: its flag, its environment variable, its default.

use axum::http::HeaderValue;
use clap::{Args, Parser, Subcommand};
use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

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
    /// Make, list and revoke API keys; works beside a service that runs
    Keys {
        /// Folder of the job database
        #[arg(long, env = "NEPHROID_DATA", default_value = "./nephroid-data", global = true)]
        data: PathBuf,
        /// What to do with the keys
        #[command(subcommand)]
        action: KeyAction,
    },
    /// Ask the service on this machine whether it takes jobs: exit code 0 if it does
    Ready {
        /// Address that it listens on
        #[arg(long, env = "NEPHROID_LISTEN", default_value = "127.0.0.1:8080")]
        listen: SocketAddr,
    },
    /// Print the OpenAPI document
    Openapi,
}

/// What can be done with keys.
#[derive(Debug, Subcommand)]
pub enum KeyAction {
    /// Make a key and print its token, which is shown only this once
    Add {
        /// What the key is for
        name: String,
    },
    /// List all keys: id, state, when it was made, what it is for
    List,
    /// Refuse a key from now on
    Revoke {
        /// The key's id
        id: String,
    },
}

impl Cli {
    /// What to do; to serve, if nothing is said.
    #[must_use]
    pub fn into_command(self) -> Command {
        self.command.unwrap_or(Command::Serve(Box::new(self.settings)))
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
    /// Jobs that share the cores, one round at a time each; with 0 jobs are taken and none is rendered
    #[arg(long, env = "NEPHROID_CONCURRENT", default_value_t = 4,
          value_parser = clap::value_parser!(u16).range(0..=64))]
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
    #[arg(long, env = "NEPHROID_MAX_MEMORY", default_value = "6G", value_parser = parse_bytes)]
    pub max_memory: usize,
    /// Most surfaces of one scene, triangles counted each
    #[arg(long, env = "NEPHROID_MAX_PRIMITIVES", default_value_t = 4_000_000)]
    pub max_primitives: usize,
    /// Most lights of one scene
    #[arg(long, env = "NEPHROID_MAX_LIGHTS", default_value_t = 1000)]
    pub max_lights: usize,
    /// Most photons that a round may send
    #[arg(long, env = "NEPHROID_MAX_PHOTONS", default_value_t = 1 << 26)]
    pub max_photons: u64,
    /// Largest asset, in bytes (suffixes k, M, G of 1024)
    #[arg(long, env = "NEPHROID_MAX_ASSET", default_value = "256M", value_parser = parse_bytes)]
    pub max_asset: usize,
    /// Jobs of one key that may be unfinished
    #[arg(long, env = "NEPHROID_JOBS_PER_KEY", default_value_t = 50)]
    pub jobs_per_key: u32,
    /// Requests per second of one key, and of one address beyond loopback that comes without; 0 for any number
    #[arg(long, env = "NEPHROID_RATE", default_value_t = 100)]
    pub rate: u32,
    /// Connections at once; more wait to be accepted
    #[arg(long, env = "NEPHROID_CONNECTIONS", default_value_t = 4096,
          value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub connections: u32,
    /// Longest time that the head of a request may take and a connection be idle (suffixes s, m, h, d)
    #[arg(long, env = "NEPHROID_HEAD_TIME", default_value = "30s", value_parser = parse_age)]
    pub head_time: Duration,
    /// Attempts at a job that may die with the service before the job is blamed and fails
    #[arg(long, env = "NEPHROID_MAX_DEATHS", default_value_t = 3,
          value_parser = clap::value_parser!(u32).range(1..))]
    pub max_deaths: u32,
    /// Finished jobs are forgotten after this time (suffixes s, m, h, d)
    #[arg(long, env = "NEPHROID_KEEP_AGE", default_value = "7d", value_parser = parse_age)]
    pub keep_age: Duration,
    /// Finished jobs that are kept
    #[arg(long, env = "NEPHROID_KEEP_JOBS", default_value_t = 10_000)]
    pub keep_jobs: u32,
    /// Size of all jobs, in bytes (suffixes k, M, G of 1024), at which the oldest finished ones are forgotten
    #[arg(long, env = "NEPHROID_KEEP_BYTES", default_value = "20G", value_parser = parse_bytes)]
    pub keep_bytes: usize,
    /// Bytes that stay free on the disk: with less, new jobs are refused
    #[arg(long, env = "NEPHROID_MIN_FREE", default_value = "256M", value_parser = parse_bytes)]
    pub min_free: usize,
    /// Origins whose pages may use the service, such as `https://example.org`; several are separated by commas
    #[arg(long, env = "NEPHROID_CORS_ORIGIN", value_delimiter = ',', value_parser = parse_origin)]
    pub cors_origin: Vec<HeaderValue>,
    /// Serve without a key whoever comes; without this flag keys are asked for as soon as one was made, and
    /// an address beyond loopback is not listened on without keys
    #[arg(long, env = "NEPHROID_OPEN")]
    pub open: bool,
    /// How the log is written
    #[arg(long, env = "NEPHROID_LOG_FORMAT", default_value = "text")]
    pub log_format: LogFormat,
}

/// How the log is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum LogFormat {
    /// Lines for people.
    Text,
    /// One JSON object a line.
    Json,
}

impl Settings {
    /// Why this address must not be listened on, if it must not.
    #[must_use]
    pub fn refusal(&self, has_keys: bool) -> Option<String> {
        let refused = !self.listen.ip().is_loopback() && !self.open && !has_keys;
        refused.then(|| {
            format!(
                "{} is not a loopback address, and there are no API keys: everyone who can reach it could use \
                 the service. Make a key with `nephroid-api keys add NAME`, or pass --open.",
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

fn parse_age(text: &str) -> Result<Duration, String> {
    let (digits, unit) = match text.char_indices().last() {
        Some((at, 's')) => (&text[..at], 1),
        Some((at, 'm')) => (&text[..at], 60),
        Some((at, 'h')) => (&text[..at], 3600),
        Some((at, 'd')) => (&text[..at], 86_400),
        _ => (text, 1),
    };
    let number: u64 = digits.parse().map_err(|_| format!("{text:?} is not a time such as 90s, 12h or 7d"))?;
    number.checked_mul(unit).map(Duration::from_secs).ok_or_else(|| format!("{text} is too long"))
}

fn parse_origin(text: &str) -> Result<HeaderValue, String> {
    let hosts = text.strip_prefix("https://").or(text.strip_prefix("http://")).unwrap_or_default();
    if hosts.is_empty() || hosts.contains(['/', '*', ' ']) {
        return Err(format!("{text:?} is not an origin such as https://example.org, without a final slash"));
    }
    text.parse().map_err(|_| format!("{text:?} has characters that no origin has"))
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
        match Cli::try_parse_from(arguments).unwrap().into_command() {
            Command::Serve(settings) => *settings,
            other => panic!("{other:?}"),
        }
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
    fn an_address_beyond_loopback_needs_keys_or_open() {
        assert!(settings(&["--listen", "0.0.0.0:80"]).refusal(false).is_some());
        assert!(settings(&["--listen", "0.0.0.0:80"]).refusal(true).is_none());
        assert!(settings(&["--listen", "0.0.0.0:80", "--open"]).refusal(false).is_none());
        assert!(settings(&["--listen", "[::1]:80"]).refusal(false).is_none());
    }

    #[test]
    fn ages_have_units_and_origins_are_whole() {
        assert_eq!(parse_age("2h"), Ok(Duration::from_secs(7200)));
        assert_eq!(parse_age("90"), Ok(Duration::from_secs(90)));
        assert!(parse_age("d").is_err());
        assert!(parse_origin("https://example.org:8443").is_ok());
        for wrong in ["*", "example.org", "https://example.org/", "https://*.example.org", ""] {
            assert!(parse_origin(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn sizes_have_binary_suffixes() {
        assert_eq!(parse_bytes("3k"), Ok(3072));
        assert_eq!(parse_bytes("77"), Ok(77));
        assert!(parse_bytes("").is_err());
        assert!(parse_bytes("99999999999G").is_err());
    }
}
