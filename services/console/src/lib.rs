//! The watch room: HTTPS, accounts and the page, as a zenoh client.
