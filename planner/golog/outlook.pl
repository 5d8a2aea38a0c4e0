:- module(planner_outlook,
          [ low/4,                      % +Program, +Situation, -Chain, -Work
            never/1,                    % -Milliseconds
            calls/3,                    % +Program, +Situation, -Heads
            lumped/4                    % +Program, +Situation, -Program, -Situation
          ]).

/** <module> What can be said of a program without executing it: bounds, calls, what is under way
*/

:- use_module(library(lists)).
:- use_module(library(apply)).
:- use_module(library(yall)).
:- use_module(library(occurs), [sub_term/2]).
:- use_module(library(ordsets)).
:- use_module(library(pairs)).
:- use_module(kb_rules(facts), [duration/3, effect/4, recursive/2]).
:- use_module(kb_rules(capability), [capable/3]).
:- use_module(planner_golog(projection)).
:- use_module(planner_golog(conditions)).
:- use_module(planner_golog(actions)).
:- use_module(planner_golog(alike)).
:- use_module(planner_golog(durations)).
:- use_module(planner_golog(horizon)).
:- use_module(planner_golog(influence)).
:- use_module(planner_golog(transition)).
:- use_module(planner_golog(travel)).

%!  never(-Milliseconds) is det.
%
%   Longer than any plan: what an impossible program takes.

never(1_000_000_000_000).

%!  low(+Program, +Situation, -Chain, -Work) is det.
%
%   Lower bounds of the longest chain and of the robot time that Program still takes.

low([], _, 0, 0).
low([P|Ps], S, C, W) :-
    low(P, S, C1, W1),
    (   Ps == []
    ->  C = C1, W = W1
    ;   may_halt(P, S)
    ->  C = C1, W = W1                              % a plan may go no further
    ;   low(Ps, S, C2, W2), C is C1 + C2, W is W1 + W2
    ).
low(test(_), _, 0, 0).
low(choice(_, _, Ps), S, C, W) :- least(P, member(P, Ps), S, C, W).
low(pick(Frame, Step, V, Class, P), S, C, W) :-
    step_id(Frame, Step, Id),
    least(Bound,
          ( member_of(Class, X, S), \+ excluded(Id, X, S), copy_term(V-P, X-Bound) ),
          S, C, W).
low(picked(_, _, P), S, C, W) :- low(P, S, C, W).
low(star(_, _, _), _, 0, 0).
low(star(_, _, _, _), _, 0, 0).
low(if(A, P, Q), S, C, W) :-
    (   may_halt(test(A), S)
    ->  C = 0, W = 0
    ;   least(R, member(R, [P, Q]), S, C, W)
    ).
low(while(_, _), _, 0, 0).
low(until(P, _), S, C, W) :- low(P, S, C, W).
low(conc(Ps), S, C, W) :- low_all(Ps, S, C, W).
low(pconc(Ps), S, C, W) :- low_all(Ps, S, C, W).
low(any_order(_, _, Ps), S, C, W) :- low_row(Ps, S, C, W).
low(any_order(_, _, Parts, _), S, C, W) :- findall(P, member(_-P, Parts), Ps), low_row(Ps, S, C, W).
low(interrupt(_, _, _, _, _), _, 0, 0).
low(search(P), S, C, W) :- low(P, S, C, W).
low(deadline(Ms, P), S, C, W) :-
    low(P, S, C1, W),
    began(S, Began), now(S, Now),
    ( Now + C1 =< Began + Ms -> C = C1 ; never(C) ).
low(foreach(F, Step, Vs, Cond, Inner, P), S, C, W) :-
    (   revision(S, Revision),
        findall(N, ( effect(Revision, Head, _, _), functor(Head, N, _) ), Names),
        lasting(Cond, Vs, Names, S)
    ->  instances(F, Step, Vs, Cond, Inner-P, S, Turns),
        low_all(Turns, S, C, W)
    ;   C = 0, W = 0                                % there may be fewer turns by then
    ).
low(call(_, _, Head), S, C, W) :- low_call(Head, S, C, W).
low(scope(_, _, P), S, C, W) :- low(P, S, C, W).
low(running(_), _, 0, 0).                           % counted with the runs

%   One after the other, in whatever order; a plan may halt after any.
low_row(Ps, S, C, W) :-
    (   may_halt(Ps, S)
    ->  C = 0, W = 0
    ;   low(Ps, S, C, W)
    ).

low_all([], _, 0, 0).
low_all([P|Ps], S, C, W) :-
    low(P, S, C1, W1),
    low_all(Ps, S, C2, W2),
    C is max(C1, C2),
    W is W1 + W2.

least(P, Goal, S, C, W) :-
    findall(C0-W0, ( Goal, low(P, S, C0, W0) ), Bounds),
    never(Never),
    foldl([C1-W1, A-B, M-N]>>( M is min(A, C1), N is min(B, W1) ), Bounds, Never-Never, C-W).

low_call(Head, S, C, W) :-
    revision(S, Revision),
    functor(Head, Name, _),
    agents_of(Head, Agents, S),
    (   member(Agent, Agents), \+ capable(Revision, Name, Agent)
    ->  never(C), W = C
    ;   duration(Revision, Head, Duration)
    ->  shortest(Head, Duration, S, C),
        length(Agents, Together),
        W is Together * C
    ;   recursive(Revision, Name)
    ->  C = 0, W = 0                                % what it does once more is not looked into
    ;   expansion(low, Head, S, Body),
        low(Body, S, C, W)
    ).

shortest(Head, Duration, S, Milliseconds) :-
    (   Duration = travel(Robot, To, Once)
    ->  (   To = fluent(_, _)                       % where to is not known yet
        ->  Way = 0
        ;   ahead(S, Travel),
            findall(T, travel_time(Travel, Robot, _, To, T), Times),
            never(Never),
            foldl([T, A, B]>>( B is min(A, T) ), Times, Never, Way)
        )
    ;   Duration = fixed(Once), Way = 0
    ),
    (   Way >= 1_000_000_000_000
    ->  Milliseconds = Way
    ;   least_time(Head, Way, Once, Milliseconds, S)
    ).

%!  calls(+Program, +Situation, -Heads) is det.
%
%   The calls that some execution may make, as far as they are known before acting, and those under way: what
%   travel times are needed for. Of robots that are alike one stands for all.

calls(P, S, Heads) :-
    called(P, S, Names),
    alike(P, Names, S, Groups),
    findall(Head, ( sub_term(T, P), nonvar(T), T = scope(_, Head, _) ), Begun0),
    sort(Begun0, Begun),
    calls([P], S, Groups, [], Called),
    ord_union(Begun, Called, Heads).

%   Of each process that may be called, the calls in its body, once.
calls([], _, _, Heads, Heads) :- !.
calls(Ps, S, Groups, Known0, Heads) :-
    findall(Head, ( member(P, Ps), call_of(P, S, Groups, Head) ), Heads0),
    sort(Heads0, Found),
    ord_subtract(Found, Known0, New),
    ord_union(Known0, New, Known),
    revision(S, Revision),
    findall(Body,
            ( member(Head, New), \+ duration(Revision, Head, _), expansion(call, Head, S, Body) ),
            Bodies),
    calls(Bodies, S, Groups, Known, Heads).

call_of([P|Ps], S, G, H) :- ( call_of(P, S, G, H) ; call_of(Ps, S, G, H) ).
call_of(choice(_, _, Ps), S, G, H) :- call_of(Ps, S, G, H).
call_of(pick(_, _, V, Class, P), S, G, H) :-
    findall(X, member_of(Class, X, S), Xs),
    grouped(Xs, G, Grouped),
    member([X|_], Grouped),
    copy_term(V-P, X-Q),
    call_of(Q, S, G, H).
call_of(picked(_, Pick, P), S, G, H) :- ( call_of(P, S, G, H) ; call_of(Pick, S, G, H) ).
call_of(if(_, P, Q), S, G, H) :- ( call_of(P, S, G, H) ; call_of(Q, S, G, H) ).
call_of(while(_, P), S, G, H) :- call_of(P, S, G, H).
call_of(until(P, _), S, G, H) :- call_of(P, S, G, H).
call_of(conc(Ps), S, G, H) :- call_of(Ps, S, G, H).
call_of(pconc(Ps), S, G, H) :- call_of(Ps, S, G, H).
call_of(any_order(_, _, Ps), S, G, H) :- call_of(Ps, S, G, H).
call_of(any_order(_, _, Parts, _), S, G, H) :- member(_-P, Parts), call_of(P, S, G, H).
call_of(star(_, _, P), S, G, H) :- call_of(P, S, G, H).
call_of(star(_, _, P, _), S, G, H) :- call_of(P, S, G, H).
call_of(search(P), S, G, H) :- call_of(P, S, G, H).
call_of(deadline(_, P), S, G, H) :- call_of(P, S, G, H).
call_of(interrupt(_, _, Vs, _, P), S, G, H) :-
    pairs_keys(Vs, Keys),
    findall(Keys, members_of(Vs, S), Tuples),
    member(Tuple, Tuples), copy_term(Keys-P, Tuple-Q), call_of(Q, S, G, H).
call_of(foreach(F, Step, Vs, C, Inner, P), S, G, H) :-
    asked(some(Vs, C), S, yes),
    instances(F, Step, Vs, C, Inner-P, S, Turns),
    call_of(Turns, S, G, H).
call_of(scope(_, _, P), S, G, H) :- call_of(P, S, G, H).
call_of(call(_, _, Head), _, _, Head).

members_of([], _).
members_of([X-Class|Vars], S) :- member_of(Class, X, S), members_of(Vars, S).

%!  lumped(+Program, +Situation, -Program, -Situation) is det.
%
%   For looking ahead from the middle of things: a composite process with a duration model that has
%   begun is one durative step that still takes as long as from where its robot is.

lumped([P|Ps], S, [P1|Ps], S1) :- !, lumped(P, S, P1, S1).
lumped(conc(Ps), S, conc(Qs), S1) :- !, foldl(lumped_part, Ps, Qs, S, S1).
lumped(pconc(Ps), S, pconc(Qs), S1) :- !, foldl(lumped_part, Ps, Qs, S, S1).
lumped(picked(Id, Pick, P), S, picked(Id, Pick, Q), S1) :- !, lumped(P, S, Q, S1).
lumped(deadline(Ms, P), S, deadline(Ms, Q), S1) :- !, lumped(P, S, Q, S1).
lumped(scope(Id, Head, P), S, Q, S1) :- !,
    (   one_step(Head, Duration, S)
    ->  agents_of(Head, Agents, S),
        foldl(stop_agent, Agents, S, S0),
        end_scope(Id, Head, S0, S2),
        (   milliseconds(Head, Duration, Milliseconds, S2),
            begin_step(Id, Head, Agents, Milliseconds, S2, S3)
        ->  take_log(S3, _, S1),                    % it has started before
            Q = running(Id)
        ;   S1 = S0,
            Q = choice(Id, no_way, [])              % without a branch: cannot be done
        )
    ;   lumped(P, S, P1, S1),
        Q = scope(Id, Head, P1)
    ).
lumped(P, S, P, S).

lumped_part(P, Q, S0, S) :- lumped(P, S0, Q, S).

stop_agent(Agent, S0, S) :-
    running(S0, Runs),
    (   member(run(_, Agents, Id, _), Runs), memberchk(Agent, Agents) -> stop(Id, S0, S) ; S = S0 ).
