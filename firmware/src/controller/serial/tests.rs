use heapless::spsc::Queue;

use super::*;

#[test]
fn what_has_come_is_taken_in_order_and_no_more_than_there_is_room_for() {
    let mut queue = Queue::<u8, 8>::new();
    let (mut interrupt, mut bytes) = queue.split();
    for byte in 1..=5 {
        interrupt.enqueue(byte).unwrap();
    }
    let mut buffer = [0; 3];
    let never = || unreachable!("bytes are there");
    assert_eq!(received(&mut bytes, &mut buffer, never), 3);
    assert_eq!(buffer, [1, 2, 3]);
    assert_eq!(received(&mut bytes, &mut buffer, never), 2);
    assert_eq!(buffer, [4, 5, 3], "the rest is left alone");
}

#[test]
fn it_waits_for_the_first_byte_and_for_no_other() {
    let mut queue = Queue::<u8, 8>::new();
    let (mut interrupt, mut bytes) = queue.split();
    let mut waited = 0;
    let mut buffer = [0; 4];
    let count = received(&mut bytes, &mut buffer, || {
        // The first wake-ups have other causes.
        waited += 1;
        if waited == 3 {
            interrupt.enqueue(9).unwrap();
        }
    });
    assert_eq!((count, waited, buffer), (1, 3, [9, 0, 0, 0]));
}

#[test]
fn without_room_it_does_not_wait() {
    let mut queue = Queue::<u8, 8>::new();
    let (_, mut bytes) = queue.split();
    let never = || unreachable!("nothing is asked for");
    assert_eq!(received(&mut bytes, &mut [], never), 0);
}
