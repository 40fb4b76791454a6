//! API keys: made and revoked by the command line, held against what requests bring.

use super::files::hex;
use super::service::now_ms;
use super::store::{self, Store};
use super::{Owner, StoreError};
use rusqlite::{Connection, params};
use sha2::{Digest, Sha256};
use std::collections::HashMap;
use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use subtle::ConstantTimeEq;

/// What every token begins with, so that tools that look for leaked secrets find it.
const PREFIX: &str = "nph";
/// A key that was revoked beside the running service is refused after this time.
const FRESH: Duration = Duration::from_secs(1);

/// A key as its owner may see it: the secret itself is not kept.
#[derive(Clone, Debug)]
pub struct Key {
    /// Its public name; also the owner of what is made with it.
    pub id: String,
    /// What it was made for.
    pub name: String,
    /// When it was made, in milliseconds since 1970.
    pub created_ms: i64,
    /// When it was revoked.
    pub revoked_ms: Option<i64>,
}

/// Makes and revokes keys, beside a service that runs or without one.
#[derive(Debug)]
pub struct KeyAdmin(Connection);

impl KeyAdmin {
    /// Opens the database in this data folder, and makes both if they are missing.
    ///
    /// # Errors
    /// If the folder or the database cannot be used.
    pub fn open(data: &Path) -> Result<Self, StoreError> {
        std::fs::create_dir_all(data).map_err(|_| StoreError::NotCommitted)?;
        store::open_for_writing(&data.join("jobs.sqlite")).map(Self)
    }

    /// Makes a key; the token is known to nobody but the caller.
    ///
    /// # Errors
    /// If there are no random numbers, or the database cannot be used.
    pub fn add(&self, name: &str) -> Result<String, StoreError> {
        let mut random = [0; 36];
        let source = File::open("/dev/urandom").and_then(|mut source| source.read_exact(&mut random));
        source.map_err(|_| StoreError::NotCommitted)?;
        let id = hex(&random[..4]);
        let token = format!("{PREFIX}_{id}_{}", hex(&random[4..]));
        self.0.execute(
            "INSERT INTO keys (id, name, hash, created_ms) VALUES (?1, ?2, ?3, ?4)",
            params![id, name, hash_of(&token), now_ms()],
        )?;
        Ok(token)
    }

    /// All keys, oldest first.
    ///
    /// # Errors
    /// If the database cannot be used.
    pub fn list(&self) -> Result<Vec<Key>, StoreError> {
        let mut find =
            self.0.prepare("SELECT id, name, created_ms, revoked_ms FROM keys ORDER BY created_ms, id")?;
        let keys = find.query_map([], |row| {
            Ok(Key { id: row.get(0)?, name: row.get(1)?, created_ms: row.get(2)?, revoked_ms: row.get(3)? })
        })?;
        Ok(keys.collect::<Result<_, _>>()?)
    }

    /// Revokes a key; false if there is no such key in force.
    ///
    /// # Errors
    /// If the database cannot be used.
    pub fn revoke(&self, id: &str) -> Result<bool, StoreError> {
        let revoke = "UPDATE keys SET revoked_ms = ?2 WHERE id = ?1 AND revoked_ms IS NULL";
        Ok(self.0.execute(revoke, params![id, now_ms()])? > 0)
    }
}

/// The keys as the service knows them: at most a second old.
#[derive(Debug)]
pub(super) struct KeyTable {
    store: Store,
    known: Mutex<Option<(Instant, Arc<Known>)>>,
}

/// The hash of each key in force by its id, and whether there ever was a key.
#[derive(Debug, Default)]
struct Known {
    hashes: HashMap<String, [u8; 32]>,
    any: bool,
}

impl KeyTable {
    pub(super) fn new(store: Store) -> Self {
        Self { store, known: Mutex::new(None) }
    }

    /// True once a key was made, even if all have been revoked: revoking the last one must open nothing.
    pub(super) async fn exist(&self) -> Result<bool, StoreError> {
        Ok(self.known().await?.any)
    }

    /// Whose token this is.
    pub(super) async fn owner_of(&self, token: &str) -> Result<Option<Owner>, StoreError> {
        let mut parts = token.split('_');
        let (Some(PREFIX), Some(id)) = (parts.next(), parts.next()) else { return Ok(None) };
        let known = self.known().await?;
        // An unknown id takes the same way, so that time tells nothing.
        let (hash, exists) = known.hashes.get(id).map_or(([0; 32], false), |hash| (*hash, true));
        let same = bool::from(hash.ct_eq(&hash_of(token)));
        Ok((same && exists).then(|| Owner::of(id)))
    }

    async fn known(&self) -> Result<Arc<Known>, StoreError> {
        let held = self.known.lock().unwrap_or_else(PoisonError::into_inner).clone();
        if let Some((since, known)) = held
            && since.elapsed() < FRESH
        {
            return Ok(known);
        }
        let known = Arc::new(self.store.read(read_keys).await?);
        *self.known.lock().unwrap_or_else(PoisonError::into_inner) =
            Some((Instant::now(), Arc::clone(&known)));
        Ok(known)
    }
}

fn read_keys(db: &Connection) -> Result<Known, StoreError> {
    let mut known = Known::default();
    let mut find = db.prepare_cached("SELECT id, hash, revoked_ms IS NULL FROM keys")?;
    let mut rows = find.query([])?;
    while let Some(row) = rows.next()? {
        known.any = true;
        if row.get(2)? {
            known.hashes.insert(row.get(0)?, row.get(1)?);
        }
    }
    Ok(known)
}

/// Tokens are 256 random bits: a plain hash is as good as a slow one.
fn hash_of(token: &str) -> [u8; 32] {
    Sha256::digest(token.as_bytes()).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_token_is_worth_something_until_it_is_revoked() {
        let folder = tempfile::tempdir().unwrap();
        let admin = KeyAdmin::open(folder.path()).unwrap();
        let store = Store::open(&folder.path().join("jobs.sqlite")).unwrap();
        let table = || KeyTable::new(store.clone());
        assert!(!table().exist().await.unwrap());
        let token = admin.add("phone").unwrap();
        let key = admin.list().unwrap().remove(0);
        assert!(!token.is_empty() && key.name == "phone");
        assert_eq!(table().owner_of(&token).await.unwrap(), Some(Owner::of(key.id.as_str())));
        for wrong in ["", "nph", "nph__", &format!("{token}0"), &token.replace(&key.id, "00000000"), "a_b_c"]
        {
            assert_eq!(table().owner_of(wrong).await.unwrap(), None, "{wrong}");
        }
        assert!(admin.revoke(&key.id).unwrap() && !admin.revoke(&key.id).unwrap());
        assert_eq!(table().owner_of(&token).await.unwrap(), None);
        assert!(table().exist().await.unwrap(), "revoking the last key opens nothing");
    }
}
