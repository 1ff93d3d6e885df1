//! Topics between real processes: nothing is lost, nobody hangs, nothing stays behind.

mod peer;

use bus::{Bus, BusName};
use peer::{Peer, leftovers};
use std::time::Duration;

/// A lost peer is found in well under a second; this only tells it from a hang.
const LOSS_SEEN: Duration = Duration::from_secs(5);

/// Ends a publisher and a subscriber that must have carried `count` messages, and leave nothing.
fn expect_complete(name: &BusName, publisher: Peer, subscribers: Vec<Peer>, count: u64) {
    let (lines, code, _) = publisher.finish();
    assert_eq!((lines.last(), code), (Some(&format!("finished {count}")), Some(0)), "{lines:?}");
    for subscriber in subscribers {
        let (lines, code, _) = subscriber.finish();
        assert_eq!((lines.last(), code), (Some(&format!("end {count}")), Some(0)), "{lines:?}");
    }
    assert_eq!(leftovers(name), Vec::<String>::new());
}

#[test]
fn subscriber_first_and_publisher_a_second_late() {
    let name = BusName::unique();
    let mut subscriber = Peer::start("subscribe", &name, "");
    subscriber.expect("opened");
    subscriber.expect_silence(Duration::from_secs(1));
    let publisher = Peer::start("publish", &name, "--messages 1000");
    expect_complete(&name, publisher, vec![subscriber], 1000);
}

#[test]
fn publisher_first_and_subscriber_a_second_late() {
    let name = BusName::unique();
    let mut publisher = Peer::start("publish", &name, "--messages 1000");
    publisher.expect("joined");
    publisher.expect_silence(Duration::from_secs(1));
    let subscriber = Peer::start("subscribe", &name, "");
    expect_complete(&name, publisher, vec![subscriber], 1000);
}

#[test]
fn both_at_once_with_messages_longer_than_a_place_in_the_queue() {
    let name = BusName::unique();
    let words = "--bytes-max 5000 --slot-bytes 64";
    let subscriber = Peer::start("subscribe", &name, words);
    let publisher = Peer::start("publish", &name, &format!("{words} --messages 500"));
    expect_complete(&name, publisher, vec![subscriber], 500);
}

#[test]
fn ten_thousand_messages_and_a_slow_subscriber() {
    let name = BusName::unique();
    let subscriber = Peer::start("subscribe", &name, "--each-us 100");
    let publisher = Peer::start("publish", &name, "--messages 10000");
    expect_complete(&name, publisher, vec![subscriber], 10_000);
}

#[test]
fn two_subscribers_of_one_topic_get_everything() {
    let name = BusName::unique();
    let publisher = Peer::start("publish", &name, "--topic scene --messages 300");
    let mut first = Peer::start("subscribe", &name, "--topic scene --role renderer --each-us 2000");
    first.expect("opened");
    // Nobody may start before the second subscriber is there.
    first.expect_silence(Duration::from_millis(300));
    let second = Peer::start("subscribe", &name, "--topic scene");
    expect_complete(&name, publisher, vec![first, second], 300);
}

#[test]
fn a_subscriber_that_has_the_end_may_leave_while_another_is_waited_for() {
    let name = BusName::unique();
    let mut first = Peer::start("subscribe", &name, "--topic scene --role renderer");
    first.expect("opened");
    let slow = Peer::start("subscribe", &name, "--topic scene --each-us 500000");
    let publisher = Peer::start("publish", &name, "--topic scene --messages 3");
    expect_complete(&name, publisher, vec![first, slow], 3);
}

/// iceoryx2 counts a subscriber that has not looked yet, and discards what exceeds its queue.
#[test]
fn a_subscriber_that_looks_late_for_the_first_time_loses_nothing() {
    let name = BusName::unique();
    let mut subscriber = Peer::start("subscribe", &name, "--first-look-ms 1500");
    subscriber.expect("opened");
    let mut publisher = Peer::start("publish", &name, "--messages 1000");
    publisher.expect("joined");
    publisher.expect_silence(Duration::from_millis(500));
    expect_complete(&name, publisher, vec![subscriber], 1000);
}

#[test]
fn a_subscriber_that_comes_and_goes_before_the_start_is_replaced() {
    let name = BusName::unique();
    let publisher = Peer::start("publish", &name, "--topic scene --messages 100");
    for signal in ["TERM", "KILL"] {
        let mut first = Peer::start("subscribe", &name, "--topic scene --role renderer");
        first.expect("opened");
        first.signal(signal);
        let (lines, code, _) = first.finish();
        assert!(code != Some(0), "{lines:?}");
    }
    let renderer = Peer::start("subscribe", &name, "--topic scene --role renderer");
    let recorder = Peer::start("subscribe", &name, "--topic scene");
    expect_complete(&name, publisher, vec![renderer, recorder], 100);
}

#[test]
fn the_answer_of_a_subscriber_that_died_before_the_start_is_void() {
    let name = BusName::unique();
    let publisher = Peer::start("publish", &name, "--topic scene --messages 100");
    let late = "--topic scene --role renderer --first-look-ms 1000";
    let mut renderer = Peer::start("subscribe", &name, late);
    renderer.expect("opened");
    let mut recorder = Peer::start("subscribe", &name, "--topic scene");
    recorder.expect("opened");
    recorder.expect_silence(Duration::from_millis(300));
    recorder.signal("KILL");
    recorder.finish();
    renderer.expect_silence(Duration::from_millis(1500));
    let recorder = Peer::start("subscribe", &name, "--topic scene");
    expect_complete(&name, publisher, vec![renderer, recorder], 100);
}

#[test]
fn a_stopped_subscriber_is_slow_and_not_dead() {
    let name = BusName::unique();
    let mut subscriber = Peer::start("subscribe", &name, "--say-every 100 --each-us 200");
    let mut publisher = Peer::start("publish", &name, "--messages 2000 --say-every 5000");
    publisher.expect("connected");
    subscriber.expect("got 100");
    subscriber.signal("STOP");
    publisher.expect_silence(Duration::from_millis(1500));
    subscriber.signal("CONT");
    expect_complete(&name, publisher, vec![subscriber], 2000);
}

#[test]
fn a_publisher_finds_a_killed_subscriber_with_a_full_queue() {
    let name = BusName::unique();
    let mut subscriber = Peer::start("subscribe", &name, "--hold-messages 1");
    let mut publisher = Peer::start("publish", &name, "--say-every 16");
    subscriber.expect("connected");
    publisher.expect("sent 16");
    publisher.expect_silence(Duration::from_millis(300));
    subscriber.signal("KILL");
    let (lines, code, time) = publisher.finish();
    println!("found after {time:?}");
    assert!(lines[0].starts_with("error topic state: the recorder was lost after 16 messages"), "{lines:?}");
    assert!(code == Some(3) && time < LOSS_SEEN, "{code:?} after {time:?}");
    drop(subscriber);
    assert_eq!(leftovers(&name), Vec::<String>::new());
}

#[test]
fn a_publisher_finds_a_killed_subscriber_that_kept_up() {
    let name = BusName::unique();
    let mut subscriber = Peer::start("subscribe", &name, "--say-every 100");
    let publisher = Peer::start("publish", &name, "");
    subscriber.expect("got 500");
    subscriber.signal("KILL");
    let (lines, code, time) = publisher.finish();
    println!("found after {time:?}");
    assert!(lines.last().unwrap().contains("the recorder was lost"), "{lines:?}");
    assert!(code == Some(3) && time < LOSS_SEEN, "{code:?} after {time:?}");
}

#[test]
fn a_subscriber_drains_what_a_killed_publisher_had_sent_and_then_knows() {
    let name = BusName::unique();
    let mut subscriber = Peer::start("subscribe", &name, "--say-every 1 --each-us 50000");
    let mut publisher = Peer::start("publish", &name, "--say-every 1");
    publisher.expect("sent 10");
    publisher.signal("KILL");
    let (sent, code, _) = publisher.finish();
    assert_eq!(code, None);
    // The publisher died while it said how far it was, or after sending one more.
    let sent = sent.last().map_or(10, |line| line["sent ".len()..].parse::<u64>().unwrap());
    subscriber.expect(&format!("got {sent}"));
    let (lines, code, time) = subscriber.finish();
    println!("known {time:?} after the last message");
    assert!(lines.last().unwrap().contains("the simulator was lost"), "{lines:?}");
    assert!(lines.len() <= 2 && code == Some(3) && time < LOSS_SEEN, "{lines:?} {code:?} {time:?}");
    assert_eq!(leftovers(&name), Vec::<String>::new());
}

#[test]
fn a_stop_ends_waiting_for_a_peer_and_for_a_place() {
    let name = BusName::unique();
    let mut publisher = Peer::start("publish", &name, "");
    publisher.expect("joined");
    publisher.signal("TERM");
    let (lines, code, time) = publisher.finish();
    assert_eq!(lines, ["error stopped while waiting for the recorder"]);
    assert!(code == Some(4) && time < LOSS_SEEN);

    let _subscriber = Peer::start("subscribe", &name, "--hold-messages 1");
    let mut publisher = Peer::start("publish", &name, "--say-every 16");
    publisher.expect("sent 16");
    publisher.signal("TERM");
    let (lines, code, time) = publisher.finish();
    assert_eq!(lines, ["error stopped while waiting for a place in the queue of topic state"]);
    assert!(code == Some(4) && time < LOSS_SEEN);
}

#[test]
fn a_stopped_publisher_that_breaks_off_is_lost_and_one_that_finishes_is_not() {
    let name = BusName::unique();
    let mut subscriber = Peer::start("subscribe", &name, "--say-every 100");
    let publisher = Peer::start("publish", &name, "--say-every 1000000");
    subscriber.expect("got 300");
    publisher.signal("TERM");
    let (lines, code, _) = publisher.finish();
    let count = lines.last().unwrap().strip_prefix("finished ").unwrap().to_owned();
    assert_eq!(code, Some(0));
    let (lines, code, _) = subscriber.finish();
    assert_eq!((lines.last().unwrap(), code), (&format!("end {count}"), Some(0)));

    let mut subscriber = Peer::start("subscribe", &name, "--hold-messages 1");
    let mut publisher = Peer::start("publish", &name, "--messages 1000000 --say-every 16");
    subscriber.expect("connected");
    publisher.expect("sent 16");
    publisher.signal("TERM");
    let (lines, code, _) = publisher.finish();
    assert!(lines[0].contains("waiting for a place") && code == Some(4), "{lines:?}");
    subscriber.signal("TERM");
    let (lines, code, _) = subscriber.finish();
    let lost = "error topic state: the simulator was lost after 16 messages";
    assert!(lines[0].starts_with(lost) && code == Some(3), "{lines:?}");
}

/// A signal handler interrupts a blocked delivery after some of the subscribers have the message.
#[test]
fn signals_during_a_blocked_delivery_lose_and_double_nothing() {
    let name = BusName::unique();
    let renderer = Peer::start("subscribe", &name, "--topic scene --role renderer --each-us 500");
    let recorder = Peer::start("subscribe", &name, "--topic scene --each-us 15000");
    let mut publisher = Peer::start("publish", &name, "--topic scene --messages 200 --say-every 10");
    publisher.expect("connected");
    for sent in (10..=190).step_by(10) {
        publisher.signal("USR1");
        publisher.expect(&format!("sent {sent}"));
    }
    expect_complete(&name, publisher, vec![renderer, recorder], 200);
}

#[test]
fn two_buses_side_by_side_do_not_meet() {
    let names = [BusName::unique(), BusName::unique()];
    let mut lonely = Peer::start("subscribe", &names[0], "");
    lonely.expect("opened");
    let subscriber = Peer::start("subscribe", &names[1], "");
    let publisher = Peer::start("publish", &names[1], "--messages 700");
    expect_complete(&names[1], publisher, vec![subscriber], 700);
    lonely.expect_silence(Duration::from_millis(100));
    let publisher = Peer::start("publish", &names[0], "--messages 70");
    expect_complete(&names[0], publisher, vec![lonely], 70);
}

#[test]
fn a_role_in_use_is_refused_and_a_killed_ones_name_is_not() {
    let name = BusName::unique();
    let mut first = Peer::start("publish", &name, "");
    first.expect("joined");
    let (lines, code, _) = Peer::start("publish", &name, "").finish();
    assert!(lines[0].contains("is in use") && lines[0].contains("simulator"), "{lines:?}");
    assert_eq!(code, Some(1));

    let mut subscriber = Peer::start("subscribe", &name, "--hold-messages 1");
    subscriber.expect("connected");
    for peer in [first, subscriber] {
        peer.signal("KILL");
        peer.finish();
    }
    assert!(!leftovers(&name).is_empty(), "a killed process cannot clean up");
    let subscriber = Peer::start("subscribe", &name, "");
    let publisher = Peer::start("publish", &name, "--messages 100");
    expect_complete(&name, publisher, vec![subscriber], 100);
}

#[test]
fn the_starter_of_killed_processes_can_clean_up_after_them() {
    let name = BusName::unique();
    let mut peers = [Peer::start("subscribe", &name, "--hold-messages 1"), Peer::start("publish", &name, "")];
    peers[0].expect("connected");
    assert!(!Bus::clean_up(&name).unwrap());
    for peer in peers {
        peer.signal("KILL");
        peer.finish();
    }
    assert!(Bus::clean_up(&name).unwrap());
    assert_eq!(leftovers(&name), Vec::<String>::new());
}

#[test]
fn who_comes_after_the_start_is_told_and_holds_nobody_up() {
    let name = BusName::unique();
    let words = "--topic scene --role renderer";
    let mut publisher = Peer::start("publish", &name, "--topic scene --count-on recorder --say-every 1000");
    let mut recorder = Peer::start("subscribe", &name, "--topic scene --say-every 1000");
    recorder.expect("got 1000");
    let (lines, code, _) = Peer::start("subscribe", &name, words).finish();
    assert!(lines.last().unwrap().contains("began without this process"), "{lines:?}");
    assert_eq!(code, Some(1));
    let mut idle = Peer::start("subscribe", &name, &format!("{words} --first-look-ms 60000"));
    idle.expect("opened");
    publisher.expect_fresh_line();
    recorder.expect_fresh_line();
    idle.signal("KILL");
    idle.finish();
    recorder.expect_fresh_line();
    publisher.signal("TERM");
    let (lines, code, _) = publisher.finish();
    assert!(lines.last().unwrap().starts_with("finished") && code == Some(0), "{lines:?}");
    let (lines, code, _) = recorder.finish();
    assert!(lines.last().unwrap().starts_with("end") && code == Some(0), "{lines:?}");
}
