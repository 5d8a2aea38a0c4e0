:- module(planner_search,
          [ best_plan/4,                % +Program, +Situation, +MaxNodes, -Result
            complete/3,                 % +Program, +Situation, -Waits
            end_runs/3                  % +Milliseconds, +Situation, -Situation
          ]).

/** <module> The least makespan of all executions of a program

Best-first search (A*) over configurations Program-Situation. A configuration has two kinds of
successors: a transition of the program, which starts a step now, and the passing of time to the next
natural end of a running step. A configuration is worth m-w: m is a lower bound of the makespan of
every execution that goes on from it, w of their total robot time. The bounds never overestimate, so
the first complete execution taken from the queue has the least makespan and, of those, the least
robot time; its makespan is its own proof (Hart, Nilsson, Raphael 1968).

Lower bound of what remains: the larger of the longest chain (sequences add up, concurrent parts do
not) and all robot time that remains over the number of robots.

Where the steps are independent, what need not be looked into is left out (planner_reduction).
*/

:- use_module(library(heaps)).
:- use_module(library(rbtrees)).
:- use_module(library(lists)).
:- use_module(library(apply)).
:- use_module(kb_rules(facts), [kind/3]).
:- use_module(planner_golog(projection)).
:- use_module(planner_golog(actions)).
:- use_module(planner_golog(horizon)).
:- use_module(planner_golog(influence)).
:- use_module(planner_golog(outlook)).
:- use_module(planner_golog(settling)).
:- use_module(planner_golog(transition)).
:- use_module(planner_golog(reduction)).

%!  best_plan(+Program, +Situation, +MaxNodes:integer, -Result) is det.
%
%   Result is one of
%     - plan(Status, Makespan, Bound, Events, Waits, Nodes): Status is optimal or satisficing; Events,
%       oldest first, are what trans/4 noted; Makespan and Bound are milliseconds from now; Waits are the
%       locations of what only acting finds out, where the plan ends because of it
%     - none(proven, Nodes): no execution exists
%     - none(unknown, Nodes): none was found within MaxNodes
%   Nodes is LookedInto-Pruned: so many configurations.

best_plan(P0, S0, MaxNodes, Result) :-
    now(S0, Start),
    team_size(S0, Robots),
    ( independent(P0, S0) -> Reduced = true ; Reduced = false ),
    settle(P0, S0, P, S),
    everyone(Idled),
    empty_heap(Heap0),
    add_node(Robots, n(P, S, 0, Idled), Heap0-0, Heap-Next),
    rb_new(Seen),
    search(Heap, Seen, Next, 0-0, MaxNodes, in(Robots, Reduced, Start), Result).

%   In is in(Robots, Reduced, Start): team size, whether steps are independent, when the plan begins.
search(Heap, Seen, Next, Nodes, MaxNodes, In, Result) :-
    In = in(_, _, Start),
    (   get_from_heap(Heap, p(Worth, _, _), Node, Heap1)
    ->  Node = n(P, S, _, _),
        (   complete(P, S, Waits)
        ->  found(S, Start, Makespan, Events),
            Result = plan(optimal, Makespan, Makespan, Events, Waits, Nodes)
        ;   Nodes = Looked_into-_, Looked_into >= MaxNodes
        ->  Bound is Worth - Start,
            first_found(P, S, Start, Bound, Nodes, Result)
        ;   expand(Node, In, Seen, Seen1, Heap1, Heap2, Next, Next1, Nodes, Nodes1),
            search(Heap2, Seen1, Next1, Nodes1, MaxNodes, In, Result)
        )
    ;   Result = none(proven, Nodes)
    ).

%!  complete(+Program, +Situation, -Waits) is semidet.
%
%   The execution ends here, or as far as one can look ahead.

complete(P, S, Waits) :-
    running(S, []),
    ( final(P, S) -> Waits = [] ; halted(P, S, Waits) ), !.

found(S, Start, Makespan, Events) :-
    now(S, End),
    log(S, Log),
    reverse(Log, Events),
    Makespan is End - Start.

%   What has the same future as something looked into before, or no end at all, is pruned.
expand(Node, In, Seen, Seen1, Heap, Heap1, Next, Next1, Looked_into-Pruned, Looked_into1-Pruned1) :-
    configuration_key(Node, Key),
    (   rb_insert_new(Seen, Key, true, Seen1)
    ->  In = in(Robots, Reduced, _),
        findall(Then, successor(Reduced, Node, Then), Nodes),
        reverse(Nodes, Reversed),
        foldl(add_node(Robots), Reversed, Heap-Next, Heap1-Next1),
        length(Nodes, Successors),
        Looked_into1 is Looked_into + 1,
        Pruned1 is Pruned + Successors - (Next1 - Next)
    ;   Seen1 = Seen, Heap1 = Heap, Next1 = Next,
        Looked_into1 = Looked_into,
        Pruned1 is Pruned + 1
    ).

%   Of equal worth, the latest first: a plan that is as good is completed, not compared. Of successors, that
%   is the first by name.
add_node(Robots, Node, Heap0-Order, Heap-Next) :-
    Node = n(P, S, Work, _),
    worth(P, S, Work, Robots, Makespan-Robot_time),
    never(Never),
    (   Makespan >= Never
    ->  Heap = Heap0, Next = Order
    ;   Latest is -Order,
        add_to_heap(Heap0, p(Makespan, Robot_time, Latest), Node, Heap),
        Next is Order + 1
    ).

%   Configurations with the same key have the same futures.
configuration_key(n(P, S, _, Idled), Key) :-
    progressed(S, Progressed),
    variant_sha1(k(P, Progressed, Idled), Key).

%!  successor(+Reduced, +Node, -Node) is nondet.
%
%   Node is n(Program, Situation, Work, Idled): Work is the robot time of the steps begun, Idled what
%   planner_reduction goes by.

successor(Reduced, n(P, S, Work, Idled), Then) :-
    moves(P, S, Moves),
    (   Reduced == true, forced(Moves, P, S, Move)
    ->  begun(Move, Work, Idled, Then)
    ;   Reduced == true
    ->  (   worthwhile(Moves, Idled, Move, Idled1),
            begun(Move, Work, Idled1, Then)
        ;   asleep(Moves, Idled2),
            passed(P, S, Work, Idled2, Then)
        )
    ;   (   member(Move, Moves),
            begun(Move, Work, Idled, Then)
        ;   passed(P, S, Work, Idled, Then)
        )
    ).

begun(move(_, _, P, S), Work, Idled, n(P, S, Work1, Idled)) :-
    log(S, [Newest|_]),
    robot_time(Newest, Time),
    Work1 is Work + Time.

robot_time(Event, Time) :-
    (   Event = started(_, _, Agents, From, To)
    ->  length(Agents, Together),
        Time is Together * (To - From)
    ;   Time = 0
    ).

%   To the next natural end; everything that ends then has ended.
passed(P, S, Work, Idled, n(Q, T, Work, Idled)) :-
    next_end(S, End),
    at_time(S, End, S1),
    end_runs(End, S1, S2),
    settle(P, S2, Q, T).

end_runs(End, S0, S) :-
    (   running(S0, [run(End, _, Id, Head)|_])
    ->  stop(Id, S0, S1),
        apply_effects(Head, S1, S2),
        end_runs(End, S2, S)
    ;   S = S0
    ).

%   Budget spent: one execution from the most promising configuration on, without going back.
first_found(P, S, Start, Bound, Nodes, Result) :-
    (   dive(2_000, P, S, T, Waits)
    ->  found(T, Start, Makespan, Events),
        ( Makespan =< Bound -> Status = optimal ; Status = satisficing ),
        Result = plan(Status, Makespan, Bound, Events, Waits, Nodes)
    ;   Result = none(unknown, Nodes)
    ).

%   Going always forward may go on for ever, in an iteration: so many steps are enough.
dive(_, P, S, S, Waits) :- complete(P, S, Waits), !.
dive(Left, P, S, End, Waits) :-
    Left > 0,
    Left1 is Left - 1,
    team_size(S, Robots),
    everyone(Idled),
    findall(Worth-(Q-T),
            ( successor(false, n(P, S, 0, Idled), n(Q, T, W, _)), worth(Q, T, W, Robots, Worth) ),
            Nodes),
    keysort(Nodes, [_-(Best-Then)|_]),
    dive(Left1, Best, Then, End, Waits).

team_size(S, Size) :-
    revision(S, Revision),
    findall(R, kind(Revision, R, 'Robot'), Robots0),
    sort(Robots0, Robots),
    length(Robots, All),
    limit(S, Limit),
    Size is max(1, min(All, Limit)).

%!  worth(+Program, +Situation, +Work, +Robots, -Worth) is det.

worth(P, S, Work, Robots, Makespan-Robot_time) :-
    low(P, S, Chain, Remaining),
    now(S, Now),
    running(S, Runs),
    busy(Runs, Now, Busy, Last),
    Shared is (Remaining + Busy + Robots - 1) // Robots,
    Makespan is Now + max(Last, max(Chain, Shared)),
    Robot_time is Work + Remaining.

busy([], _, 0, 0).
busy([run(End, Agents, _, _)|Runs], Now, Busy, Last) :-
    busy(Runs, Now, Busy0, Last0),
    Left is max(0, End - Now),
    Last is max(Last0, Left),
    length(Agents, Together),
    Busy is Busy0 + Together * Left.
