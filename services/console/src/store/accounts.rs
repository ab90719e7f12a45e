//! Accounts, sessions and the claim.

use super::{Store, StoreError};
use crate::secret::Digest;
use crate::{Account, Role, Session};
use rusqlite::{Connection, OptionalExtension, params};
use std::collections::BTreeSet;

/// An account to be made.
#[derive(Clone, Debug)]
pub struct NewAccount {
    /// The account; its number is given by the store.
    pub account: Account,
    /// The password's hash.
    pub password: String,
}

/// What two addresses that are the same have in common.
fn folded(email: &str) -> String {
    email.to_lowercase()
}

fn drones_of(connection: &Connection, id: i64) -> rusqlite::Result<BTreeSet<String>> {
    connection
        .prepare("SELECT drone FROM account_drones WHERE account = ?1")?
        .query_map([id], |row| row.get(0))?
        .collect()
}

fn set_drones(connection: &Connection, id: i64, drones: &BTreeSet<String>) -> rusqlite::Result<()> {
    connection.execute("DELETE FROM account_drones WHERE account = ?1", [id])?;
    let mut insert = connection.prepare("INSERT INTO account_drones VALUES (?1, ?2)")?;
    for drone in drones {
        insert.execute(params![id, drone])?;
    }
    Ok(())
}

fn insert(connection: &Connection, new: NewAccount, now_ms: u64) -> rusqlite::Result<Account> {
    let NewAccount { mut account, password } = new;
    connection.execute(
        "INSERT INTO accounts (name, surname, email, email_folded, password, role, language, disabled, made_ms)
         VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9)",
        params![
            account.name,
            account.surname,
            account.email,
            folded(&account.email),
            password,
            account.role.word(),
            account.language,
            account.disabled,
            now_ms as i64
        ],
    )?;
    account.id = connection.last_insert_rowid();
    set_drones(connection, account.id, &account.drones)?;
    Ok(account)
}

impl Store {
    /// All accounts.
    ///
    /// # Errors
    /// SQLite's. So are those of all the others here.
    pub async fn accounts(&self) -> Result<Vec<Account>, StoreError> {
        self.run(|connection| {
            let mut accounts: Vec<Account> = connection
                .prepare("SELECT id, name, surname, email, role, language, disabled FROM accounts")?
                .query_map([], |row| {
                    let role: String = row.get(4)?;
                    Ok(Account {
                        id: row.get(0)?,
                        name: row.get(1)?,
                        surname: row.get(2)?,
                        email: row.get(3)?,
                        // The table allows no other word; the least, should it be damaged.
                        role: Role::from_word(&role).unwrap_or(Role::Viewer),
                        language: row.get(5)?,
                        drones: BTreeSet::new(),
                        disabled: row.get(6)?,
                    })
                })?
                .collect::<Result<_, _>>()?;
            for account in &mut accounts {
                account.drones = drones_of(connection, account.id)?;
            }
            Ok(accounts)
        })
        .await
    }

    /// Makes an account.
    ///
    /// # Errors
    /// [`StoreError::EmailTaken`].
    pub async fn add_account(&self, new: NewAccount, now_ms: u64) -> Result<Account, StoreError> {
        let email = new.account.email.clone();
        let added = self
            .run(move |connection| {
                let transaction = connection.transaction()?;
                let taken = is_taken(&transaction, &new.account.email)?;
                let account = if taken { None } else { Some(insert(&transaction, new, now_ms)?) };
                transaction.commit()?;
                Ok(account)
            })
            .await?;
        added.ok_or(StoreError::EmailTaken(email))
    }

    /// Writes an account as it is now; the password only when there is a new one.
    ///
    /// # Errors
    /// SQLite's.
    pub async fn change_account(&self, account: Account, password: Option<String>) -> Result<(), StoreError> {
        self.run(move |connection| {
            let transaction = connection.transaction()?;
            transaction.execute(
                "UPDATE accounts SET name = ?2, surname = ?3, role = ?4, language = ?5, disabled = ?6 WHERE id = ?1",
                params![
                    account.id,
                    account.name,
                    account.surname,
                    account.role.word(),
                    account.language,
                    account.disabled
                ],
            )?;
            if let Some(password) = password {
                transaction
                    .execute("UPDATE accounts SET password = ?2 WHERE id = ?1", params![account.id, password])?;
            }
            set_drones(&transaction, account.id, &account.drones)?;
            transaction.commit()
        })
        .await
    }

    /// The first administrator, once: only while there is no account and `digest` is that of the newest claim code.
    ///
    /// # Errors
    /// [`StoreError::Claimed`]. `None` for a wrong code.
    pub async fn claim(
        &self,
        digest: Digest,
        new: NewAccount,
        now_ms: u64,
    ) -> Result<Option<Account>, StoreError> {
        let done = self
            .run(move |connection| {
                let transaction =
                    connection.transaction_with_behavior(rusqlite::TransactionBehavior::Immediate)?;
                if count_accounts(&transaction)? > 0 {
                    return Ok(None);
                }
                let right = transaction
                    .query_row("SELECT 1 FROM claim WHERE digest = ?1", [digest.as_slice()], |_| Ok(()))
                    .optional()?;
                if right.is_none() {
                    return Ok(Some(None));
                }
                let account = insert(&transaction, new, now_ms)?;
                transaction.execute("DELETE FROM claim", [])?;
                transaction.commit()?;
                Ok(Some(Some(account)))
            })
            .await?;
        done.ok_or(StoreError::Claimed)
    }

    /// Keeps the digest of the only claim code that counts from now on. `false` when the console has been claimed.
    ///
    /// # Errors
    /// SQLite's.
    pub async fn offer_claim(&self, digest: Digest) -> Result<bool, StoreError> {
        self.run(move |connection| {
            let transaction =
                connection.transaction_with_behavior(rusqlite::TransactionBehavior::Immediate)?;
            let free = count_accounts(&transaction)? == 0;
            if free {
                transaction.execute("INSERT OR REPLACE INTO claim VALUES (1, ?1)", [digest.as_slice()])?;
            }
            transaction.commit()?;
            Ok(free)
        })
        .await
    }

    /// Number and password hash of who has this e-mail address.
    ///
    /// # Errors
    /// SQLite's.
    pub async fn password_of(&self, email: &str) -> Result<Option<(i64, String)>, StoreError> {
        let email = folded(email);
        self.run(move |connection| {
            connection
                .query_row("SELECT id, password FROM accounts WHERE email_folded = ?1", [email], |row| {
                    Ok((row.get(0)?, row.get(1)?))
                })
                .optional()
        })
        .await
    }

    /// All sessions.
    ///
    /// # Errors
    /// SQLite's.
    pub async fn sessions(&self) -> Result<Vec<(Digest, Session)>, StoreError> {
        self.run(|connection| {
            connection
                .prepare("SELECT digest, account, began_ms, seen_ms FROM sessions")?
                .query_map([], |row| {
                    let session = Session {
                        account: row.get(1)?,
                        began_ms: row.get::<_, i64>(2)?.max(0) as u64,
                        seen_ms: row.get::<_, i64>(3)?.max(0) as u64,
                    };
                    Ok((row.get::<_, [u8; 32]>(0)?, session))
                })?
                .collect()
        })
        .await
    }

    /// Writes a session down and forgets those in `gone`.
    ///
    /// # Errors
    /// SQLite's.
    pub async fn keep_session(
        &self,
        digest: Digest,
        session: Session,
        gone: Vec<Digest>,
    ) -> Result<(), StoreError> {
        self.run(move |connection| {
            let transaction = connection.transaction()?;
            transaction.execute(
                "INSERT OR REPLACE INTO sessions VALUES (?1, ?2, ?3, ?4)",
                params![digest.as_slice(), session.account, session.began_ms as i64, session.seen_ms as i64],
            )?;
            forget(&transaction, &gone)?;
            transaction.commit()
        })
        .await
    }

    /// Writes down when a session was last used.
    ///
    /// # Errors
    /// SQLite's.
    pub async fn session_seen(&self, digest: Digest, now_ms: u64) -> Result<(), StoreError> {
        self.run(move |connection| {
            connection
                .execute(
                    "UPDATE sessions SET seen_ms = ?2 WHERE digest = ?1",
                    params![digest.as_slice(), now_ms as i64],
                )
                .map(|_| ())
        })
        .await
    }

    /// Forgets sessions.
    ///
    /// # Errors
    /// SQLite's.
    pub async fn forget_sessions(&self, gone: Vec<Digest>) -> Result<(), StoreError> {
        self.run(move |connection| forget(connection, &gone)).await
    }
}

fn forget(connection: &Connection, gone: &[Digest]) -> rusqlite::Result<()> {
    let mut delete = connection.prepare("DELETE FROM sessions WHERE digest = ?1")?;
    for digest in gone {
        delete.execute([digest.as_slice()])?;
    }
    Ok(())
}

fn count_accounts(connection: &Connection) -> rusqlite::Result<i64> {
    connection.query_row("SELECT count(*) FROM accounts", [], |row| row.get(0))
}

fn is_taken(connection: &Connection, email: &str) -> rusqlite::Result<bool> {
    connection.query_row("SELECT count(*) FROM accounts WHERE email_folded = ?1", [folded(email)], |row| {
        row.get::<_, i64>(0).map(|count| count > 0)
    })
}
