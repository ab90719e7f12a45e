//! The table as it is printed, and its words.

use control::{Action, Cause, Condition, Loss, OperatorLost, Policy, Stage, TABLE, TakeOver, failsafe_page};

#[test]
fn the_page_is_what_the_table_says() {
    let committed =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../docs/failsafes.md")).unwrap();
    assert!(
        committed == failsafe_page(&Policy::default()),
        "write it anew: cargo run -p control --example failsafes > docs/failsafes.md"
    );
}

#[test]
fn the_page_has_every_row_with_its_numbers() {
    let policy = Policy { pose_hover_s: 1.25, p_lost: 0.125, clear_s: 0.75, ..Policy::default() };
    let page = failsafe_page(&policy);
    let rows: Vec<&str> = page.lines().filter(|line| line.starts_with("| ")).collect();
    assert_eq!(rows.len(), 1 + TABLE.len() + 1 + Loss::ALL.len());
    let pose = rows.iter().find(|row| row.starts_with("| position uncertain |")).unwrap();
    let cells: Vec<&str> = pose.split('|').map(str::trim).collect();
    assert!(cells[2].contains("P(lost) > 12.5 %"), "{pose}");
    assert_eq!(
        cells[3..8],
        [
            "1.25 s (`pose_hover_s`)",
            "hover",
            "0.75 s without it (`clear_s`)",
            "yes, once it stands",
            "refused"
        ]
    );
    for row in TABLE {
        assert!(row.after.key.is_empty() || page.contains(&format!("(`{}`)", row.after.key)), "{row:?}");
    }
    for condition in Condition::ALL {
        if let Some((_, key)) = condition.clear(&policy) {
            assert!(page.contains(&format!(" s without it (`{key}`)")), "{condition:?}");
        }
    }
}

#[test]
fn no_two_words_are_the_same() {
    fn differ<'a>(words: impl Iterator<Item = &'a str>, count: usize) {
        let mut words: Vec<&str> = words.filter(|word| !word.is_empty()).collect();
        words.sort_unstable();
        words.dedup();
        assert_eq!(words.len(), count);
    }
    differ(Action::ALL.iter().map(|action| action.word()), 6);
    differ(Cause::ALL.iter().map(|cause| cause.words()), 13);
    differ(Loss::ALL.iter().map(|loss| loss.words()), 7);
    differ([TakeOver::Yes, TakeOver::AfterStop, TakeOver::No].iter().map(|rule| rule.words()), 3);
    differ([OperatorLost::Hold, OperatorLost::Return, OperatorLost::Land].iter().map(|lost| lost.word()), 3);
    assert_eq!(Stage::ALL.iter().filter(|stage| stage.in_the_air()).count(), 3);
    for (code, cause) in Cause::ALL.iter().enumerate() {
        assert_eq!(cause.bit(), 1 << code, "{cause:?}");
    }
}
