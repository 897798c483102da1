//! An action server of any type that does what the number in a goal says: from 100 on it is rejected; from 20 on it is
//! active until its cancellation is asked for, which 90 ignores and the others take; 80 refuses it, and is active until a
//! message of /go; 60 is accepted only after one. 10 is aborted, others succeed.

use std::{iter, pin::pin};

use futures::{join, StreamExt};
use ros2_client::{action::GoalEndStatus, Message};

use crate::{reliable, Peer};

/// What the types of an action differ in.
pub trait Script {
    type Goal: Message + Clone + 'static;
    type Outcome: Message + Clone + 'static;
    type Feedback: Message + 'static;

    /// The name of the action, the package of its type, and its type.
    const ACTION: [&'static str; 3];

    fn number(goal: &Self::Goal) -> f64;

    /// The other fields of a goal that our link fills, for the test to compare.
    fn fields(goal: &Self::Goal) -> String;

    fn feedback(goal: &Self::Goal) -> Self::Feedback;

    fn outcome(number: f64) -> Self::Outcome;

    /// Called for each goal that comes.
    fn take(&self, _goal: &Self::Goal) {}
}

pub async fn serve<S: Script>(mut peer: Peer, script: S) {
    let [action, package, kind] = S::ACTION;
    let server = peer.action_server::<S::Goal, S::Outcome, S::Feedback>(action, package, kind);
    let go = peer.subscription::<String>("/go", "String", reliable());
    println!("ready");
    let work = async {
        let mut go = pin!(go.async_stream());
        loop {
            let new = server.receive_new_goal().await.expect("a goal");
            let goal = server.get_new_goal(new.clone()).expect("the goal");
            let number = S::number(&goal);
            println!("goal {number}\nfields {}", S::fields(&goal));
            script.take(&goal);
            if number >= 100.0 {
                server.reject_goal(new).await.expect("a rejection");
                continue;
            }
            if number == 60.0 {
                go.select_next_some().await.expect("a message");
            }
            let accepted = server.accept_goal(new).await.expect("an acceptance");
            let sent = server.start_executing_goal(accepted).await.expect("a goal");
            let published = server.publish_feedback(sent.clone(), S::feedback(&goal));
            assert!(published.await.is_ok(), "feedback");
            let mut end = GoalEndStatus::Succeeded;
            if number == 10.0 {
                end = GoalEndStatus::Aborted;
            } else if number >= 20.0 {
                let asked = server.receive_cancel_request().await.expect("a request");
                println!("cancel {number}");
                if number == 80.0 {
                    let refused = server.respond_to_cancel_requests(&asked, iter::empty());
                    refused.await.expect("a refusal");
                    go.select_next_some().await.expect("a message");
                } else {
                    let ids = iter::once(sent.goal_id());
                    let taken = server.respond_to_cancel_requests(&asked, ids);
                    taken.await.expect("a response");
                    if number != 90.0 {
                        end = GoalEndStatus::Canceled;
                    }
                }
            }
            println!("end {number} {end:?}");
            let result = server.send_result_response(sent, end, S::outcome(number));
            result.await.expect("a result");
        }
    };
    join!(work, peer.tell_matches());
}
